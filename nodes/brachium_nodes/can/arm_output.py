"""What of an arm may go to a machine: skeletons in, joint values out. Pure: times are arguments.

Only what is measured and good is valid. A value is never repeated: where nothing new came, or what came does
not fit what was before, a joint is invalid and says why. This is no safety function.
"""

from collections import deque
from math import pi, radians

from brachium_nodes.can.arm_frames import ArmValue, JointValue, Reason, fits
from brachium_nodes.can.joint_table import JOINTS, JointRow, JointTable
from brachium_nodes.can.segment_watch import LONGEST_TICK_NS, SegmentWatch
from brachium_wire.messages import Calibration, Origin, Skeleton

SILENCE_NS = 38_000_000
"""After a skeleton, so long without the next is silence: with a frame each 10 ms, none is valid 50 ms after
the last one; and those of nodes that send each 20 ms come in time."""
AHEAD_NS = 20_000_000
"""A sample from the future is one whose age is not known."""
SPEED_TICKS = 2
"""The speed is the mean over so many ticks, so it lags by one."""


class ArmOutput:
    """One arm. `take` every skeleton, `value` whenever a frame is due."""

    def __init__(self, table: JointTable, origins: frozenset[Origin] = frozenset({"worn"})) -> None:
        """`origins`: whose samples may become valid; another than worn must be asked for by name."""
        self._table, self._origins = table, origins
        self._rows = [table.joint.get(name, JointRow()) for name in JOINTS]
        letter = table.side[0]
        upper, forearm, hand = f"upper_arm_{letter}", f"forearm_{letter}", f"hand_{letter}"
        self._rests_on = [("sternum", upper)] * 3 + [(upper, forearm)] * 2 + [(forearm, hand)] * 2
        self._watches = {s: SegmentWatch() for s in ("sternum", upper, forearm, hand)}
        self._last: Skeleton | None = None
        self._angles: list[deque[tuple[int, float]]] = [deque(maxlen=SPEED_TICKS + 1) for _ in JOINTS]
        self._calibrating = False

    @property
    def jumped(self) -> list[str]:
        """Segments that jumped and were not calibrated since."""
        return [name for name, watch in self._watches.items() if watch.jumped]

    def hear(self, calibration: Calibration) -> None:
        """Take what fusion tells of the subject's calibration.

        One that was under way and is done makes good what jumped. Done alone does not: fusion says it again
        with every warning, such as that of a strap that slipped.
        """
        if calibration.state == "done" and self._calibrating:
            for watch in self._watches.values():
                watch.forgive()
        self._calibrating = calibration.state in ("waiting", "running")

    def take(self, skeleton: Skeleton) -> None:
        """Take the arm's next skeleton."""
        last = self._last
        if last is not None and skeleton.time_ns <= last.time_ns:
            return
        if last is not None and last.forward != skeleton.forward:
            self._forget()
        self._last = skeleton
        for segment, watch in self._watches.items():
            pose = skeleton.segments.get(segment)
            if pose is None or pose.quality != "good" or pose.world_from_segment is None:
                watch.lose()
            else:
                watch.see(skeleton.time_ns, pose.world_from_segment)
        for name, angles in zip(JOINTS, self._angles, strict=True):
            self._follow(angles, skeleton.time_ns, skeleton.angles.get(name))

    def value(self, now_ns: int | None, arrived_ago_ns: int) -> ArmValue:
        """Return the arm at host time `now_ns`, None while that is not known.

        `arrived_ago_ns`: how long ago the last skeleton came, by a clock that never jumps.
        """
        skeleton = self._last
        if skeleton is None:
            return ArmValue(None, None, "", [JointValue(Reason.SILENT)] * len(JOINTS))
        age_ns = None if now_ns is None else now_ns - skeleton.time_ns
        reason = self._arm_reason(skeleton, age_ns, arrived_ago_ns)
        if reason is not Reason.VALID:
            joints = [JointValue(reason)] * len(JOINTS)
        else:
            joints = [self._joint(place, skeleton) for place in range(len(JOINTS))]
        return ArmValue(skeleton.time_ns, age_ns, skeleton.origin, joints)

    def _arm_reason(self, skeleton: Skeleton, age_ns: int | None, arrived_ago_ns: int) -> Reason:
        if skeleton.origin not in self._origins:
            return Reason.ORIGIN
        if arrived_ago_ns > SILENCE_NS:
            return Reason.SILENT
        if age_ns is None or not -AHEAD_NS <= age_ns <= self._table.max_age_ms * 1e6:
            return Reason.STALE
        if any(watch.jumped for watch in self._watches.values()):
            return Reason.IMPLAUSIBLE
        return Reason.VALID

    def _joint(self, place: int, skeleton: Skeleton) -> JointValue:
        name, row, angles = JOINTS[place], self._rows[place], self._angles[place]
        if name not in skeleton.angles or name in skeleton.assumed:
            return JointValue(Reason.NOT_MEASURED)
        resting = [s for s in self._rests_on[place] if s in skeleton.segments]
        if not all(self._watches[s].steady for s in resting) or len(angles) <= SPEED_TICKS:
            return JointValue(Reason.SETTLING)
        (first_ns, first), (last_ns, last) = angles[0], angles[-1]
        angle = row.sign * (last - radians(row.zero_deg)) + radians(row.offset_deg)
        sd = skeleton.angle_sd.get(name)
        limit = self._table.max_sd_deg
        if not fits(angle) or (limit is not None and (sd is None or sd > radians(limit))):
            return JointValue(Reason.RANGE)
        return JointValue(Reason.VALID, angle, row.sign * (last - first) / (1e-9 * (last_ns - first_ns)), sd)

    def _follow(self, angles: deque[tuple[int, float]], time_ns: int, angle: float | None) -> None:
        """Let a joint's angle go on from its last one, without jumps of a whole turn."""
        if angle is None or (angles and time_ns - angles[-1][0] > LONGEST_TICK_NS):
            angles.clear()
        if angle is None:
            return
        if angles:
            angle -= 2.0 * pi * round((angle - angles[-1][1]) / (2.0 * pi))
        angles.append((time_ns, angle))

    def _forget(self) -> None:
        for watch in self._watches.values():
            watch.forgive()
        for angles in self._angles:
            angles.clear()
