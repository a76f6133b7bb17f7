"""One arm's motion as arrays: what every measure takes. Pure."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from brachium_body.angles import COLUMNS
from brachium_body.segments import Side
from brachium_viewer.metrics.holes import NOTHING, Rows, with_holes
from brachium_wire.messages import Origin, Quality, Skeleton
from brachium_wire.skeleton_columns import SkeletonColumns

Floats = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]

MEASURED: frozenset[Quality] = frozenset({"good", "disturbed"})
"""What counts as measured. `disturbed` is: the filter leaves the magnetic field out while it lasts."""

JOINTS = ("shoulder", "elbow", "wrist", "hand")


@dataclass(frozen=True, kw_only=True, eq=False)
class ArmMotion:
    """An arm at n instants in growing order. What is not known is NaN, what is not measured is so marked.

    Rows are evenly spaced as far as they can be: where no skeleton came, there are rows that are `missing`.
    """

    side: Side
    origin: Origin
    time_s: Floats
    """(n,) from any zero."""
    angles_deg: dict[str, Floats]
    """By angles.COLUMNS: (n,), unwrapped."""
    quality: dict[str, npt.NDArray[np.str_]]
    """By angle and joint: (n,) the words of messages.Quality, `missing` where there is no number."""
    positions_m: dict[str, Floats]
    """By JOINTS: (n, 3) in trunk axes."""
    shoulder_shift_m: Floats
    """(n, 3) in trunk axes from the pose; NaN where it is not measured, as while it fades in or out."""
    shoulder_shift_sd_m: Floats
    """(n, 3) its standard deviation along these axes; NaN where nobody stated one."""
    sternum: Mask
    """(n,) where a sensor on the sternum measures the trunk: elsewhere a shoulder's movement may be the
    trunk's."""

    @property
    def with_sternum(self) -> bool:
        """Return whether the trunk is measured at some instant."""
        return bool(self.sternum.any())

    def measured(self, name: str) -> Mask:
        """Return where (n,) an angle or joint is measured: neither held nor assumed nor uncalibrated."""
        return np.isin(self.quality[name], list(MEASURED))

    def known(self, name: str) -> Floats:
        """Return an angle (n,) deg, NaN wherever it is not measured."""
        return np.where(self.measured(name), self.angles_deg[name], np.nan)

    def between(self, from_s: float, to_s: float) -> "ArmMotion":
        """Return the instants in [from_s, to_s)."""
        first, end = (int(i) for i in np.searchsorted(self.time_s, [from_s, to_s]))
        return self.at(slice(first, end))

    def at(self, rows: slice | Mask) -> "ArmMotion":
        """Return some of the instants."""
        return ArmMotion(
            side=self.side,
            origin=self.origin,
            time_s=self.time_s[rows],
            angles_deg={name: values[rows] for name, values in self.angles_deg.items()},
            quality={name: words[rows] for name, words in self.quality.items()},
            positions_m={name: places[rows] for name, places in self.positions_m.items()},
            shoulder_shift_m=self.shoulder_shift_m[rows],
            shoulder_shift_sd_m=self.shoulder_shift_sd_m[rows],
            sternum=self.sternum[rows],
        )


def arm_motion(skeletons: SkeletonColumns, zero_ns: int = 0) -> ArmMotion:
    """Return the motion of one arm's skeletons; times count from `zero_ns`.

    A time without skeletons that is too long to be bridged becomes rows in which all is `missing` (holes).
    Raises ValueError when there are none, or their times do not grow.
    """
    if not len(skeletons):
        raise ValueError("there are no skeletons of this arm; record while fusion runs")
    if (np.diff(skeletons.time_ns) <= 0).any():
        raise ValueError("these skeletons' times do not grow; put them on one clock first: steady_times")
    time_s, rows = with_holes((skeletons.time_ns - zero_ns) / 1e9)
    angles = dict(zip(COLUMNS, np.degrees(skeletons.angles_rad(COLUMNS)).T, strict=True))
    places = {joint: skeletons.positions_m(joint) for joint in JOINTS}
    known = {name: np.isfinite(values) for name, values in angles.items()}
    known |= {joint: np.isfinite(place).all(axis=1) for joint, place in places.items()}
    quality = {name: np.where(there, _words(skeletons, name), "missing") for name, there in known.items()}
    there = np.isin(_words(skeletons, "shoulder"), list(MEASURED))
    shift = np.where(there[:, None], skeletons.shoulder_shift_m(), np.nan)
    return ArmMotion(
        side=skeletons.last.side,
        origin=skeletons.last.origin,
        time_s=time_s,
        angles_deg={name: _at(values, rows, np.nan) for name, values in angles.items()},
        quality={name: _at(words, rows, "missing") for name, words in quality.items()},
        positions_m={name: _at(place, rows, np.nan) for name, place in places.items()},
        shoulder_shift_m=_at(shift, rows, np.nan),
        shoulder_shift_sd_m=_at(skeletons.shoulder_shift_sd_m(), rows, np.nan),
        sternum=_at(skeletons.each(_with_sternum, np.bool_), rows, False),
    )


def _at(values: npt.NDArray[Any], rows: Rows, nothing: object) -> npt.NDArray[Any]:
    """Return the values of rows (m,), and what stands for none where there is NOTHING."""
    found: npt.NDArray[Any] = values[rows]
    found[rows == NOTHING] = nothing
    return found


def _words(skeletons: SkeletonColumns, name: str) -> npt.NDArray[np.str_]:
    return skeletons.each(lambda skeleton: skeleton.assumed.get(name, "good"))


def _with_sternum(skeleton: Skeleton) -> bool:
    return "sternum" in skeleton.segments and skeleton.segments["sternum"].quality in MEASURED
