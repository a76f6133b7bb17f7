"""One arm's motion as arrays: what every measure takes. Pure."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from brachium_body.angles import COLUMNS
from brachium_body.segments import Side
from brachium_wire.messages import Origin, Quality, Skeleton

Floats = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]

MEASURED: frozenset[Quality] = frozenset({"good", "disturbed"})
"""What counts as measured. `disturbed` is: the filter leaves the magnetic field out while it lasts."""

JOINTS = ("shoulder", "elbow", "wrist", "hand")


@dataclass(frozen=True, kw_only=True, eq=False)
class ArmMotion:
    """An arm at n instants in growing order. What is not known is NaN, what is not measured is so marked."""

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
    """(n, 3) in trunk axes from the pose."""
    with_sternum: bool
    """Whether the trunk is measured: without it a shoulder's movement may be the trunk's."""

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
            with_sternum=self.with_sternum,
        )


def arm_motion(skeletons: Sequence[Skeleton], zero_ns: int = 0) -> ArmMotion:
    """Return the motion of one arm's skeletons; times count from `zero_ns`.

    Raises ValueError when there are none.
    """
    if not skeletons:
        raise ValueError("there are no skeletons of this arm; record while fusion runs")
    n, last = len(skeletons), skeletons[-1]
    angles = np.full((n, len(COLUMNS)), np.nan)
    words = np.full((len(COLUMNS) + len(JOINTS), n), "missing", dtype="<U15")
    places = np.full((len(JOINTS), n, 3), np.nan)
    shift = np.full((n, 3), np.nan)
    _fill([s.angles for s in skeletons], _COLUMN, angles)
    _fill([s.positions for s in skeletons], _JOINT, places.transpose(1, 0, 2))
    words[: len(COLUMNS)][np.isfinite(angles.T)] = "good"
    words[len(COLUMNS) :][np.isfinite(places).all(axis=2)] = "good"
    doubted: dict[tuple[str, str], list[int]] = {}
    for i, skeleton in enumerate(skeletons):
        for doubt in skeleton.assumed.items():
            doubted.setdefault(doubt, []).append(i)
        if skeleton.shoulder_shift is not None:
            shift[i] = skeleton.shoulder_shift
    for (name, quality), which in doubted.items():
        if name in _WORD:
            row, rows = words[_WORD[name]], np.array(which)
            row[rows[row[rows] == "good"]] = quality
    return ArmMotion(
        side=last.side,
        origin=last.origin,
        time_s=np.array([(s.time_ns - zero_ns) / 1e9 for s in skeletons], dtype=np.float64),
        angles_deg=dict(zip(COLUMNS, np.degrees(angles).T, strict=True)),
        quality=dict(zip((*COLUMNS, *JOINTS), words, strict=True)),
        positions_m=dict(zip(JOINTS, places, strict=True)),
        shoulder_shift_m=shift,
        with_sternum=any(
            "sternum" in s.segments and s.segments["sternum"].quality != "missing" for s in skeletons
        ),
    )


_COLUMN = {name: i for i, name in enumerate(COLUMNS)}
_JOINT = {name: i for i, name in enumerate(JOINTS)}
_WORD = {name: i for i, name in enumerate((*COLUMNS, *JOINTS))}


def _fill(rows: Sequence[Mapping[str, object]], columns: Mapping[str, int], out: Floats) -> None:
    """Put what each row (n,) holds by name into its columns of out (n, k) or (n, k, 3).

    Rows that hold the same names are put in at once: an arm has the same angles for minutes.
    """
    alike: dict[tuple[str, ...], list[int]] = {}
    for i, row in enumerate(rows):
        alike.setdefault(tuple(row), []).append(i)
    for names, which in alike.items():
        held = [k for k, name in enumerate(names) if name in columns]
        if held:
            table = np.array([tuple(rows[i].values()) for i in which], dtype=np.float64)
            out[np.ix_(which, [columns[names[k]] for k in held])] = table[:, held]
