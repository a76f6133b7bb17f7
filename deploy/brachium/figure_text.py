"""Figures for a person: three significant digits, and a unit where the figure's name has none."""

from collections.abc import Mapping
from dataclasses import asdict, is_dataclass
from typing import Any

DIGITS = 3
_SHARES = ("covered", "covered_worst", "samples_off", "valid_before", "accel_scale")
"""Names that do not say that they are shares of one."""


def lines(figures: Any) -> list[str]:
    """Return a line for each figure of a dataclass; those of an inner one stand under its name."""
    plain: Any = figures
    if is_dataclass(figures) and not isinstance(figures, type):
        plain = asdict(figures)
    return _lines(plain, "")


def _lines(figures: Mapping[str, Any], indent: str) -> list[str]:
    found: list[str] = []
    for name, value in figures.items():
        words = f"{indent}{name.replace('_', ' ')}"
        if isinstance(value, Mapping) and value:
            found += [words, *_lines(value, indent + "  ")]
        elif isinstance(value, list | tuple) and any(isinstance(one, Mapping) for one in value):
            for number, one in enumerate(value, 1):
                found += [f"{words} {number}", *_lines(one, indent + "  ")]
        else:
            found.append(f"{words:<32} {_told(value)}{unit(name) if _is_number(value) else ''}")
    return found


def unit(name: str) -> str:
    """Return what stands behind a figure whose name has no unit; "" where the name has one, or counts."""
    words = name.split("_")
    if "cpu" in words and words[-1] != "s":
        return " of one core"
    return " of 1" if name in _SHARES else ""


def _is_number(value: Any) -> bool:
    """Return whether it is one or several numbers with a fraction: counts need no unit."""
    if isinstance(value, list | tuple):
        return bool(value) and all(_is_number(one) for one in value)
    return isinstance(value, float)


def _told(value: Any) -> str:
    if isinstance(value, list | tuple):
        return ", ".join(map(_told, value)) or "none"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{float(f'{value:.{DIGITS}g}'):g}"
    return "none" if value is None or value == {} else str(value)
