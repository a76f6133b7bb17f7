"""What a promised figure is: the command that measures it, where it stands in its JSON, and its target."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

Take = Callable[[dict[str, Any]], float | None]


@dataclass(frozen=True, kw_only=True)
class Promise:
    """One figure: what it is, where it stands in the command's JSON, and what it must not exceed."""

    name: str
    unit: str
    take: Take
    at_most: float | None = None
    """None: stated, with no target."""


@dataclass(frozen=True, kw_only=True)
class Proof:
    """One command whose JSON holds figures; `{data}` and `{folder}` in its words are filled in."""

    name: str
    commands: tuple[tuple[str, ...], ...]
    """Run in this order; the last one's JSON is read."""
    promises: tuple[Promise, ...]
    needs_data: bool = False


def at(*path: str) -> Take:
    """Take the number at this path of the JSON; None where there is none."""

    def take(figures: Any) -> float | None:
        for step in path:
            figures = figures.get(step) if isinstance(figures, dict) else None
        return None if figures is None else float(figures)

    return take


def figure(name: str, unit: str, *path: str, at_most: float | None = None) -> Promise:
    """Return the promise of the number at this path."""
    return Promise(name=name, unit=unit, take=at(*path), at_most=at_most)
