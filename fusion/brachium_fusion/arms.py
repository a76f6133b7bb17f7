"""Kinematics of many arms at once: orientations of sensors at solved instants in, skeletons out. Pure.

Everything but the memory of each arm's last angles is computed for all rows in one go; the memory takes each
arm's rows one after another.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from brachium_body import rotation
from brachium_body.angles import INDEX, SHOULDER, joint_angles
from brachium_body.assumptions import (
    ASSUMED,
    EMPTY,
    StatedAngles,
    complete,
    known_set,
    provenance,
    withhold,
)
from brachium_body.continuation import AngleTracker
from brachium_body.denavit_hartenberg import printed_angles
from brachium_body.kinematics import TRUNK_FROM_THORAX, SegmentOrientations, between, positions
from brachium_body.segments import SIDES, Side
from brachium_fusion.rows import Row
from brachium_fusion.settings import Settings
from brachium_fusion.shoulder_return import ShoulderReturn
from brachium_fusion.skeletons import messages
from brachium_fusion.timeline import Reading
from brachium_wire.messages import Skeleton

Floats = npt.NDArray[np.float64]

_NOTHING = Reading(np.full(4, np.nan), np.full(4, np.nan), 0.0, "missing", 0, 0)
_ON_HEADING = np.array([INDEX[n] for n in SHOULDER if n != "isb_elevation"])


class Arms:
    """The arms' memory, and the solving of rows."""

    def __init__(self, settings: Settings) -> None:
        self._printed = settings.filter == "complementary-printed"
        self._tracker = AngleTracker()
        self._return = ShoulderReturn()
        self._index: dict[tuple[str, Side], int] = {}

    def solve(self, rows: Sequence[Row]) -> list[Skeleton]:
        """Return one skeleton a row, in the order of the rows."""
        if not rows:
            return []
        left = np.array([row.side == "left" for row in rows])
        frames = [row.frame for row in rows]
        numbers = np.concatenate([frame.numbers for frame in frames]).reshape(-1, 40)
        world_from_sensor = _orientations(rows)
        if any(frame.turned for frame in frames):
            world_from_sensor = rotation.multiply(numbers[:, :16].reshape(-1, 4, 4), world_from_sensor)
        world_from_segment = rotation.multiply(world_from_sensor, numbers[:, 16:32].reshape(-1, 4, 4))
        trunk_from_world = numbers[:, 32:36]
        thorax_known = np.array([row.frame.sternum and row.readings[0] is not None for row in rows])
        from_pose = None
        if thorax_known.any():
            thorax_from_world = rotation.inverse(world_from_segment[:, 0])
            moving = rotation.multiply(TRUNK_FROM_THORAX, thorax_from_world)
            world_from_pose = rotation.multiply(rotation.inverse(trunk_from_world), TRUNK_FROM_THORAX)
            from_pose = rotation.multiply(rotation.inverse(world_from_pose), world_from_segment[:, 0])
            from_pose[~thorax_known] = np.nan
            trunk_from_world = np.where(thorax_known[:, None], moving, trunk_from_world)
        in_trunk = rotation.multiply(trunk_from_world[:, None], world_from_segment[:, 1:])
        measured = SegmentOrientations(in_trunk[:, 0], in_trunk[:, 1], in_trunk[:, 2])
        known = known_set(measured)
        full = measured
        if not (known == 7).all():
            full = complete(measured, left, _stated_rows(rows))
        joints = between(full)
        shift = _shifts(rows, trunk_from_world)
        raw = joint_angles(
            *joints,
            left,
            calibration_from_thorax=from_pose,
            shoulder_shift=None if shift is None else shift[:, 0],
            chest_to_shoulder=numbers[:, 36],
        )
        shift_known = False if shift is None else ~np.isnan(shift[:, 0, 0])
        silent = np.array(["missing" in row.qualities[1:] for row in rows])
        codes = provenance(known, thorax_known, shift_known, silent)
        angles = withhold(self._follow(rows, raw, joints.thorax_from_upper_arm, left), codes.angles)
        if self._printed:
            angles[:, :7] = withhold(printed_angles(joints, left), codes.angles[:, :7])
        drifting = np.array([row.withhold_heading for row in rows])
        if drifting.any():
            angles[np.ix_(drifting, _ON_HEADING)] = np.nan
        moved, returning = self._return.follow(rows, None if shift is None else shift[:, 0])
        places = withhold(positions(*full, numbers[:, 36:], left, moved), codes.positions)
        place_codes = codes.positions
        if returning is not None and returning.any():
            place_codes = np.where(returning[:, None] & (place_codes != EMPTY), ASSUMED, place_codes)
        return messages(
            rows,
            world_from_sensor,
            world_from_segment,
            trunk_from_world,
            angles,
            codes.angles,
            places,
            place_codes.astype(np.uint8),
            shift,
        )

    def _follow(
        self, rows: Sequence[Row], raw: Floats, thorax_from_upper_arm: Floats, left: npt.NDArray[np.bool_]
    ) -> Floats:
        """Let each arm's angles follow its last ones, its rows in order of time."""
        arms = np.array([self._arm(row.subject, row.side) for row in rows])
        self._tracker.grow(len(self._index))
        result = np.empty_like(raw)
        turns = _turns(arms)
        order = np.argsort(turns, kind="stable")
        for now in np.split(order, np.flatnonzero(np.diff(turns[order])) + 1):
            result[now] = self._tracker.step(arms[now], raw[now], thorax_from_upper_arm[now], left[now])
        return result

    def _arm(self, subject: str, side: Side) -> int:
        return self._index.setdefault((subject, side), len(self._index))

    def state(self, subject: str) -> dict[str, Any]:
        """Return the memory of one subject's arms, as plain values: NaN (nothing yet) as None."""
        last = self._tracker.state()
        angles = {
            side: [None if np.isnan(v) else v for v in last[i].tolist()]
            for (who, side), i in self._index.items()
            if who == subject and i < len(last)
        }
        return {"angles": angles, "shoulders": self._return.state(subject)}

    def restore(self, subject: str, state: dict[str, Any]) -> None:
        """Go on as the arms whose memory this is would have."""
        rows = {
            self._arm(subject, side): [np.nan if v is None else v for v in values]
            for side, values in state["angles"].items()
            if side in SIDES
        }
        self._return.restore(subject, state["shoulders"])
        self._tracker.grow(len(self._index))
        last = self._tracker.state()
        for index, values in rows.items():
            last[index] = values
        self._tracker.restore(last)


def _orientations(rows: Sequence[Row]) -> Floats:
    """Return world_from_sensor (n, 4 slots, 4) at the rows' instants, NaN where nothing is known."""
    readings = [reading or _NOTHING for row in rows for reading in row.readings]
    before = np.concatenate([reading.before for reading in readings]).reshape(-1, 4)
    after = np.concatenate([reading.after for reading in readings]).reshape(-1, 4)
    fraction = np.array([reading.fraction for reading in readings])
    return rotation.slerp(before, after, fraction).reshape(-1, 4, 4)


def _shifts(rows: Sequence[Row], trunk_from_world: Floats) -> Floats | None:
    """Return shoulder shift and its sd (n, 2, 3) m in trunk axes, NaN where not known; None without any."""
    if all(row.shift is None for row in rows):
        return None
    result = np.full((len(rows), 2, 3), np.nan)
    for i, row in enumerate(rows):
        if row.shift is not None:
            turn = rotation.to_matrix(trunk_from_world[i])
            result[i, 0] = turn @ row.shift.metres
            result[i, 1] = np.sqrt(turn**2 @ row.shift.sd**2)  # of an ellipsoid along the world's axes
    return result


def _turns(arms: npt.NDArray[np.intp]) -> npt.NDArray[np.intp]:
    """Return for each row how many rows of the same arm stand before it."""
    seen: dict[int, int] = {}
    turns = np.empty(len(arms), dtype=np.intp)
    for i, arm in enumerate(arms.tolist()):
        turns[i] = seen[arm] = seen.get(arm, -1) + 1
    return turns


def _stated_rows(rows: Sequence[Row]) -> StatedAngles:
    return StatedAngles(
        elbow_flexion=np.array([row.frame.stated.elbow_flexion for row in rows]),
        forearm_pronation=np.array([row.frame.stated.forearm_pronation for row in rows]),
        wrist_flexion=np.array([row.frame.stated.wrist_flexion for row in rows]),
        wrist_deviation=np.array([row.frame.stated.wrist_deviation for row in rows]),
    )
