"""Captures solved as `brachium solve` solves them, by the name of a table's column."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal

from brachium_fusion import solve
from brachium_fusion.orientation import FilterName

Mode = Literal["live", "best"]
METHODS: Mapping[str, tuple[FilterName, Mode]] = {
    "printed": ("complementary-printed", "live"),
    "corrected": ("complementary", "live"),
    "vqf": ("vqf", "live"),
    "auto": ("auto", "live"),
    "best": ("auto", "best"),
}
"""`solve --filter` and `--mode`."""
WORDS: Mapping[str, str] = {"vqf": "VQF", "auto": "live"}
"""How a column is headed where it is not by the method's name."""


def solved(
    folder: Path, method: str, *, magnetometer: bool = True, rate_hz: float | None = None
) -> solve.SolveReport:
    """Return what a method of METHODS makes of a capture folder."""
    filter_name, mode = METHODS[method]
    more: dict[str, Any] = {} if mode == "live" else {"mode": mode}
    return solve.run(
        solve.SolveSettings(
            input=folder, filter=filter_name, magnetometer=magnetometer, rate_hz=rate_hz, **more
        )
    )


def word(method: str) -> str:
    """Return how a method's column is headed."""
    return WORDS.get(method, method)
