"""What `brachium solve` takes, and what it gives."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal, get_args

import numpy as np
import numpy.typing as npt

from brachium_fusion.orientation import FilterName
from brachium_fusion.pose import Alignment
from brachium_fusion.result import GROUPS, Group
from brachium_fusion.settings import Settings
from brachium_fusion.zhou_recording import ZhouName
from brachium_wire.messages import Forward, Skeleton

Mode = Literal["live", "best"]
MODES: tuple[Mode, ...] = get_args(Mode)


NO_CALIBRATION = (
    "no calibration: mounting taken as stated (identity where not), quality uncalibrated; give "
    "[calibration] in capture.toml"
)


class SolveError(ValueError):
    """The input cannot be solved: one line that says what was expected, what came and what to do."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SolveSettings:
    """What `brachium solve` takes."""

    input: Path
    out: Path | None = None
    """`.csv` or `.parquet`; None writes nothing."""
    subject: str | None = None
    """Which subject of a recording; needed only where there are several."""
    filter: FilterName | ZhouName | None = None
    """None: what the recording used live; `auto` for a capture folder."""
    magnetometer: bool = True
    rate_hz: float | None = None
    mode: Mode = "live"
    """`live`: what the live service would give; `best`: from the whole recording, past and future."""
    groups: Sequence[Group] = GROUPS


@dataclass(frozen=True, slots=True, kw_only=True)
class SolveReport:
    """What was solved."""

    rows: int
    sides: list[str]
    filter: str
    forward: Forward
    """Which rule said where forward is."""
    quality: dict[str, dict[str, int]]
    """Per segment: instants by quality."""
    drops: dict[str, int]
    warnings: list[str]
    scores: dict[str, float] = field(default_factory=dict)
    mode: Mode = "live"
    parts: dict[str, str] = field(default_factory=dict)
    """With `best`: what was used for each part of the way."""
    refused: dict[str, str] = field(default_factory=dict)
    """What could not be had, and the reason."""
    assumptions: dict[str, str] = field(default_factory=dict)
    """What is not measured but rests on an assumption, `elbow_angles`, and on which."""
    live_compared: int = 0
    """Of a recording: instants that were live, too, and how far the two differ at most."""
    live_angle_rad: float | None = None
    live_position_m: float | None = None
    out: str | None = None
    skeletons: list[Skeleton] = field(default_factory=list, repr=False)


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcome:
    """What was solved, before it is written."""

    chosen: Settings
    skeletons: list[Skeleton]
    times_ns: Sequence[int]
    times_s: npt.NDArray[np.float64]
    """The same as they are shown."""
    warnings: list[str]
    alignment: Alignment | None
    magnetometer: bool
    """Whether some sensor's magnetic field was used."""
    drops: Counter[str] = field(default_factory=Counter)
    metadata: dict[str, object] = field(default_factory=dict)
    live: tuple[int, float, float] | None = None
    parts: dict[str, str] = field(default_factory=dict)
    refused: dict[str, str] = field(default_factory=dict)
