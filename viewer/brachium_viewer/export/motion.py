"""The motion of one or both arms, as every format takes it. Pure."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from brachium_body import rotation
from brachium_body.angles import COLUMNS, TRUNK
from brachium_body.kinematics import JOINTS, TRUNK_FROM_THORAX, JointRotations
from brachium_body.segments import SEGMENTS, SIDES, Side, arm_segments, suffix
from brachium_body.sides import mirror_left
from brachium_viewer.export.rows import PARTS, period_s
from brachium_viewer.marks import in_words
from brachium_wire.table import Table, TableError

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True, kw_only=True, eq=False)
class ArmPath:
    """One arm at n instants; what is not known is NaN."""

    side: Side
    angles_deg: dict[str, Floats]
    """By angles.COLUMNS, those that the table has: (n,)."""
    positions_m: dict[str, Floats]
    """By JOINTS: (n, 3) in trunk axes."""
    shoulder_shift_m: Floats
    """(n, 3) in trunk axes."""
    joints: JointRotations
    """Each segment against the next nearer one (n, 4), not mirrored; what no sensor saw is as assumed."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Motion:
    """Arms on one grid of instants, and what the file has to say of itself."""

    time_s: Floats
    """(n,) growing."""
    arms: dict[Side, ArmPath]
    world_from_segment: dict[str, Floats]
    """By segment, those that the table has: (n, 4)."""
    world_from_thorax: Floats
    """(n, 4) in ISB axes; NaN while nothing tells where the trunk is."""
    trunk_deg: dict[str, Floats]
    """trunk_flexion, trunk_lateral, trunk_rotation (n,) deg, those that the table has."""
    table: Table
    """What all this comes from."""
    about: dict[str, Any]
    """What every file says of itself: origin, notice, settings and so on."""

    @property
    def rate_hz(self) -> float:
        """Return instants a second."""
        return 1.0 / period_s(self.time_s)

    @property
    def events(self) -> list[dict[str, Any]]:
        """Return what was marked while the motion lasts, `time_s` counted from its first instant.

        `text` says all of it: formats that have room for no data still tell which exercise it was.
        """
        first, last = float(self.time_s[0]), float(self.time_s[-1])
        told = self.about.get("events", [])
        return [
            e | {"time_s": e["time_s"] - first, "text": _all_of(e)}
            for e in told
            if first <= e["time_s"] <= last
        ]

    @property
    def ground_from_world(self) -> Floats:
        """Return what turns world axes (4,) to those of a level ground: X forward, Y up, Z to the right.

        Forward is where the trunk faces when it is first known; world's y when it never is.
        """
        known = self.world_from_thorax[np.isfinite(self.world_from_thorax).all(axis=1)]
        trunk = rotation.multiply(known[:1], rotation.inverse(TRUNK_FROM_THORAX))
        heading = float(rotation.heading(trunk)[0]) if len(trunk) else 0.0
        return rotation.multiply(rotation.inverse(TRUNK_FROM_THORAX), rotation.about(2, -heading))


def _all_of(event: dict[str, Any]) -> str:
    said = (in_words(str(event["kind"]), event.get("data") or {}), str(event["text"]))
    return ": ".join(part for part in said if part)


def motion(table: Table, about: dict[str, Any]) -> Motion:
    """Return the motion that a result table holds. Raises TableError when it does not say which arm it is."""
    n = len(table)
    sides = sides_of(table)
    segments = {s: _block(table, [f"{s}_q{part}" for part in PARTS]) for s in SEGMENTS}
    known: dict[str, Floats] = {s: block for s, block in segments.items() if block is not None}
    arms: dict[Side, ArmPath] = {
        side: _arm(table, side, suffix(side) if len(sides) > 1 else "", known) for side in sides
    }
    thorax = known.get("sternum", np.full((n, 4), np.nan)).copy()
    for side, arm in arms.items():
        upper_arm = known.get(arm_segments(side)[0])
        if upper_arm is not None and "sternum" not in known:
            found = rotation.multiply(upper_arm, rotation.inverse(arm.joints.thorax_from_upper_arm))
            thorax = np.where(np.isnan(thorax), found, thorax)
    return Motion(
        time_s=np.asarray(table.columns["time"], dtype=np.float64),
        arms=arms,
        world_from_segment=known,
        world_from_thorax=thorax,
        trunk_deg={name: table.columns[name] for name in TRUNK if name in table.columns},
        table=table,
        about=about,
    )


def sides_of(table: Table) -> list[Side]:
    """Return whose arms a table holds. Raises TableError when it does not say."""
    told = table.metadata.get("sides")
    names = [name.removeprefix("quality_").partition("_q")[0] for name in table.columns]
    found: list[Side] = [side for side in SIDES if any(n.endswith(suffix(side)) for n in names)]
    if isinstance(told, list):
        found = [side for side in SIDES if side in told]
    if "time" not in table.columns or not found:
        raise TableError("this is no result of brachium solve: it names no time and no arm")
    return found


def _arm(table: Table, side: Side, ending: str, segments: dict[str, Floats]) -> ArmPath:
    angles = {name: table.columns[name + ending] for name in COLUMNS if name + ending in table.columns}
    unknown = np.full((len(table), 3), np.nan)

    def place(stem: str) -> Floats | None:
        return _block(table, [f"{stem}_{axis}{ending}" for axis in "xyz"])

    shift = place("shoulder_shift")
    return ArmPath(
        side=side,
        angles_deg=angles,
        positions_m={joint: p for joint in JOINTS if (p := place(joint)) is not None},
        shoulder_shift_m=unknown if shift is None else shift,
        joints=_joints(angles, side, segments, len(table)),
    )


def _joints(angles_deg: dict[str, Floats], side: Side, segments: dict[str, Floats], n: int) -> JointRotations:
    """Return the joints' rotations (n, 4): from angles, which hold what is assumed too, and of the wrist from
    both segments where both are known, since two angles leave its twist out."""
    rad = {name: np.radians(values) for name, values in angles_deg.items()}
    nothing = np.full(n, np.nan)

    def of(name: str) -> Floats:
        return rad.get(name, nothing)

    flexion, abduction = of("shoulder_flexion"), of("shoulder_abduction")
    swing = rotation.from_rotation_vector(np.stack([-abduction, 0.0 * flexion, flexion], axis=-1))
    shoulder = rotation.multiply(swing, rotation.about(1, of("shoulder_rotation")))
    straight = np.isnan(of("isb_carrying")) & ~np.isnan(
        of("elbow_flexion")
    )  # no pose states a carrying angle
    carrying = rotation.about(0, np.where(straight, 0.0, of("isb_carrying")))
    bent = rotation.multiply(rotation.about(2, of("elbow_flexion")), carrying)
    elbow = rotation.multiply(bent, rotation.about(1, of("forearm_pronation")))
    wrist = rotation.multiply(
        rotation.about(2, -of("wrist_deviation")), rotation.about(0, of("wrist_flexion"))
    )
    joints = [mirror_left(q, side) for q in (shoulder, elbow, wrist)]
    _, forearm, hand = arm_segments(side)
    if forearm in segments and hand in segments:
        seen = rotation.multiply(rotation.inverse(segments[forearm]), segments[hand])
        joints[2] = np.where(np.isfinite(seen).all(axis=1, keepdims=True), seen, joints[2])
    return JointRotations(*joints)


def _block(table: Table, names: list[str]) -> Floats | None:
    if not all(name in table.columns for name in names):
        return None
    return np.stack([np.asarray(table.columns[name], dtype=np.float64) for name in names], axis=-1)
