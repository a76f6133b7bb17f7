"""What numbers and names an option takes: argparse says the message and ends with exit code 2."""

import re
from argparse import ArgumentTypeError
from collections.abc import Callable
from math import inf
from pathlib import Path

LONGEST_S = 1e7
"""Four months: more than any run, and less than what a wait of the operating system takes."""


def real(low: float = -inf, high: float = inf) -> Callable[[str], float]:
    """Return the type of finite numbers from `low` to `high`, both included."""
    bounds = f"a number from {low:g} to {high:g}" if -inf < low or high < inf else "a finite number"

    def parsed(text: str) -> float:
        try:
            value = float(text)
        except ValueError:
            value = inf
        if not (-inf < value < inf and low <= value <= high):
            raise ArgumentTypeError(f"{text!r} cannot be used: write {bounds}")
        return value

    return parsed


def whole(low: int, high: int) -> Callable[[str], int]:
    """Return the type of whole numbers from `low` to `high`, both included."""

    def parsed(text: str) -> int:
        try:
            value = int(text)
        except ValueError:
            value = low - 1
        if not low <= value <= high:
            raise ArgumentTypeError(f"{text!r} cannot be used: write a whole number from {low} to {high}")
        return value

    return parsed


def span_s(text: str) -> tuple[float, float]:
    """Return the two times of FROM:TO in s, at least a second apart."""
    first, _, last = text.partition(":")
    try:
        from_s, to_s = real(0.0, LONGEST_S)(first), real(0.0, LONGEST_S)(last)
    except ArgumentTypeError:
        from_s = to_s = 0.0
    if to_s - from_s < 1.0:
        raise ArgumentTypeError(
            f"{text!r} cannot be used: write FROM:TO in seconds, a second or more, as in 4:7.5"
        )
    return from_s, to_s


def sha256(text: str) -> str:
    """Return `text` if it is a SHA-256 in lower-case hex."""
    if not re.fullmatch("[0-9a-f]{64}", text):
        raise ArgumentTypeError(f"{text[:80]!r} cannot be used: write 64 digits of lower-case hex")
    return text


duration_s = real(0.001, LONGEST_S)
probability = real(0.0, 1.0)
port = whole(1, 65535)
port_or_any = whole(0, 65535)
seed = whole(0, 2**32 - 1)


def folder(text: str) -> Path:
    """Return a folder's path, there or not yet; a file in its place or on its way is refused."""
    path = Path(text)
    for place in (path, *path.parents):
        if place.exists() and not place.is_dir():
            raise ArgumentTypeError(f"{text!r} cannot be used: {place} is a file, and a folder goes there")
    return path
