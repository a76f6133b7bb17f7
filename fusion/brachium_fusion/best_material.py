"""What `--mode best` starts from, whether it came as a capture folder or as a recording. Pure."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
import numpy.typing as npt

from brachium_fusion.arm_knowledge import Centres
from brachium_fusion.calibrated import Calibrated
from brachium_fusion.uniform import Series
from brachium_wire.messages import Info, Session

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class TimedSpan:
    """What the person did from when to when, s; kinds as in sensor_to_segment.Span."""

    kind: str
    from_s: float
    to_s: float
    angles_deg: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Material:
    """All samples of one subject, by its segments, on one clock: time_ns = zero_ns + 1e9 time_s."""

    series: Mapping[str, Series]
    infos: Mapping[str, Info]
    sequences: Mapping[str, npt.NDArray[np.int64]]
    """The number of each sample."""
    session: Session
    spans: tuple[TimedSpan, ...] = ()
    """What calibrates it; empty: nobody said."""
    find_pose: bool = False
    """Without spans, the first stillness is the n-pose."""
    stated: Centres = field(default_factory=dict)
    zero_ns: int = 0
    warnings: tuple[str, ...] = ()

    def span_s(self) -> tuple[float, float]:
        """Return the times of the first and the last sample of all."""
        return (
            min(float(one.time_s[0]) for one in self.series.values()),
            max(float(one.time_s[-1]) for one in self.series.values()),
        )


def calibrated(raw: Series, info: Info, *, magnetometer: bool) -> Series:
    """Return a sensor's series with its calibration applied, without its field where that is not wanted."""
    apply = Calibrated(info.calibration)
    return replace(
        raw,
        gyr=None if raw.gyr is None else apply.gyr(raw.gyr),
        acc=None if raw.acc is None else apply.acc(raw.acc),
        mag=None if raw.mag is None or not magnetometer else apply.mag(raw.mag),
    )
