"""One segment's sensor over time: batches in, orientation at any instant within what was received. Pure."""

from collections import Counter
from typing import Any

import numpy as np
import numpy.typing as npt

from brachium_body import rotation
from brachium_fusion.bridging import SIDE, bridge
from brachium_fusion.calibrated import Calibrated
from brachium_fusion.orientation import FilterName, OrientationFilter, make
from brachium_fusion.sample_block import Block, Carried, Moved
from brachium_fusion.timeline import Timeline
from brachium_wire.codec import Drop
from brachium_wire.messages import Info, Quality
from brachium_wire.samples import Samples
from brachium_wire.sequence import SequenceCounter

Floats = npt.NDArray[np.float64]

BRIDGE_NS = 100_000_000
"""A gap up to this is bridged by interpolation when its far end is there, and marked held."""
CARRIED_NS = 150_000_000
"""What was bridged of a gap up to this is kept for those who follow a sensor sample by sample."""
RESTART_NS = 500_000_000
"""After a longer gap the filter starts anew: what it would carry over is further off than a fresh start."""
SETTLE_NS = 5_000_000_000
"""After a gap that was not bridged, tilt and heading take this long to come back (VQF's tau_acc is 3 s)."""
AHEAD_NS = 1_000_000_000
"""A sample cannot be from later than its arrival; one that claims more than this would end the stream."""
STILL_RAD_S = 0.15
"""A sensor turning slower than this is still: above hand tremor and sway, far below any movement."""
DISTURBED_NS = 2_000_000_000
"""A magnetic disturbance is reported once it lasted this long; brushing past a chair is not worth a flag."""


class SegmentTrack:
    """Everything about one sensor that changes. `feed` takes batches in order of arrival."""

    def __init__(self, info: Info, filter_name: FilterName, use_magnetometer: bool) -> None:
        self.info = info
        self.magnetometer = info.magnetometer and use_magnetometer and not info.orientation_only
        self.counter = SequenceCounter()
        self.last_ns = 0
        self.still_since_ns = 0
        """All samples from here on were still; host time."""
        self.batch_ns = 0
        """The longest time that a recent batch spanned: how far behind a healthy sensor may seem."""
        self._filter_name: FilterName = filter_name
        self._filter = self._new_filter()
        self.timeline = Timeline()
        self._last: tuple[Floats, Floats] | None = None
        """gyr and acc of the last samples, at least one."""
        self._disturbed_since: int | None = None
        self._settled_ns = 0
        self.restarts = 0
        """How often the filter, or a sensor that runs its own, may have lost its heading by a long gap."""
        self.reboots = 0
        """How often the node began to number anew."""
        self._calibrated = Calibrated(info.calibration)

    def _new_filter(self) -> OrientationFilter:
        return make(self._filter_name, 1.0 / self.info.rate_hz, self.magnetometer)

    @property
    def shares_world(self) -> bool:
        """Whether its world's heading is the common one: magnetic north holds it, or another reference."""
        return self.magnetometer or (self.info.orientation_only and not self.info.heading_free)

    def feed(self, samples: Samples, drops: Counter[str]) -> bool:
        """Take a batch; return False, with the reason counted in samples, when it cannot be used."""
        n = len(samples)
        if samples.late:
            drops[Drop.LATE.value] += n
            return False
        if samples.time_ns[-1] > samples.received_ns + samples.uncertainty_ns + AHEAD_NS:
            drops[Drop.OUT_OF_RANGE.value] += n
            return False
        counter = self.counter
        if samples.time_ns[0] <= self.last_ns and samples.sequence >= (counter.next or 0):
            # Before it is counted: a batch that is refused must not move the number that is expected.
            drops[Drop.TIME_BACKWARDS.value] += n
            return False
        if counter.next is not None and samples.sequence < counter.next and samples.time_ns[0] > self.last_ns:
            # A low number with a new time is no old batch: the node was switched off and on.
            counter.begin_again(samples.sequence)
            self.reboots += 1
        repeated = counter.repeated
        gap = counter.feed(samples.sequence, n)
        if gap < 0:
            again = counter.repeated - repeated
            drops.update({Drop.REPEATED.value: again} if again else {})
            drops.update({Drop.OUT_OF_ORDER.value: n - again} if n > again else {})
            return False
        if samples.quat is not None:
            self._feed_orientation(samples)
        else:
            self._feed_inertial(samples, gap)
        self.batch_ns = max(samples.time_ns[-1] - samples.time_ns[0], int(0.9 * self.batch_ns))
        self.last_ns = samples.time_ns[-1]
        return True

    def _feed_inertial(self, samples: Samples, gap: int) -> None:
        assert samples.gyr is not None
        assert samples.acc is not None
        gyr, acc = self._calibrated.gyr(samples.gyr), self._calibrated.acc(samples.acc)
        mag = None if samples.mag is None else self._calibrated.mag(samples.mag)
        silence = samples.time_ns[0] - self.last_ns if self.timeline else 0
        kind: Quality | None = None
        carried: Carried | None = None
        period_ns = 1e9 / self.info.rate_hz
        missing = round(silence / period_ns) - 1 if gap or silence > 2.5 * period_ns else 0
        if missing > 0 and self.timeline:
            kind = "held" if silence <= BRIDGE_NS else "missing"
            if kind == "missing":
                self._settled_ns = samples.time_ns[0] + SETTLE_NS
            if silence > RESTART_NS:
                self._filter = self._new_filter()
                self.restarts += 1
            else:
                carried = self._bridge(gyr, acc, missing, samples.time_ns[0])
        quats = self._filter.update(gyr, acc, mag, samples.mag_index)
        moved = Moved(gyr, acc, self._last)
        self._last = _newest(self._last, gyr, acc) if len(gyr) < SIDE else (gyr, acc)
        self._note_still(gyr, samples.time_ns)
        self._append(samples, quats, moved, kind, self._is_disturbed(samples.time_ns[-1]), carried)

    def _bridge(self, gyr: Floats, acc: Floats, missing: int, until_ns: int) -> Carried | None:
        """Carry the filter over missing samples, along a straight line where the gap is too long to be
        waited for. Return what was found of one that is."""
        assert self._last is not None
        waited_for = until_ns - self.last_ns <= CARRIED_NS
        side = SIDE if waited_for else 1
        before = np.hstack([self._last[0][-side:], self._last[1][-side:]])
        rows = bridge(before, np.hstack([gyr[:side], acc[:side]]), missing)
        columns = np.ascontiguousarray(rows[:, :3]), np.ascontiguousarray(rows[:, 3:])
        quats = self._filter.update(*columns, None, None)
        if not waited_for:
            return None
        self._last = _newest(self._last, rows[:, :3], rows[:, 3:])
        step = (until_ns - self.last_ns) / (missing + 1)
        return Carried(
            [self.last_ns + round(step * i) for i in range(missing + 1)],
            np.vstack([self.timeline.last.quats[-1:], quats]),
            np.vstack([before[-1:], rows]),
        )

    def _feed_orientation(self, samples: Samples) -> None:
        quats = samples.quat
        assert quats is not None
        silence = samples.time_ns[0] - self.last_ns if self.timeline else 0
        kind: Quality | None = None
        if self.timeline and silence > 2.5e9 / self.info.rate_hz:
            kind = "held" if silence <= BRIDGE_NS else "missing"
            if self.info.heading_free and silence > RESTART_NS:
                self.restarts += 1  # switched off and on it would have another heading
        previous = self.timeline.last.quats[-1] if self.timeline else quats[0]
        steps = rotation.angle_between(np.vstack([previous, quats[:-1]]), quats) * self.info.rate_hz
        self._note_still(np.column_stack([steps, np.zeros((len(steps), 2))]), samples.time_ns)
        self._append(samples, quats, None, kind, disturbed=False, carried=None)

    def _note_still(self, gyr: Floats, times: list[int]) -> None:
        if self.still_since_ns == 0:
            self.still_since_ns = times[0]
        after = len(times)
        for x, y, z in reversed(
            gyr.tolist()
        ):  # the last movement tells; a few numbers, faster than as arrays
            after -= 1
            if x * x + y * y + z * z > STILL_RAD_S**2:
                self.still_since_ns = times[after] + 1
                return

    def _is_disturbed(self, now_ns: int) -> bool:
        if now_ns < self._settled_ns:
            return True
        if not self._filter.disturbed:
            self._disturbed_since = None
            return False
        if self._disturbed_since is None:
            self._disturbed_since = now_ns
        return now_ns - self._disturbed_since >= DISTURBED_NS

    def _append(
        self,
        samples: Samples,
        quats: Floats,
        moved: Moved | None,
        gap: Quality | None,
        disturbed: bool,
        carried: Carried | None,
    ) -> None:
        before_ns, before = 0, quats[0]
        if self.timeline:
            last = self.timeline.last
            before_ns, before = last.times[-1], last.quats[-1]
        self.timeline.append(
            Block(
                before_ns,
                before,
                samples.time_ns,
                quats,
                moved,
                samples.sequence,
                samples.received_ns,
                gap,
                disturbed,
                carried,
            )
        )

    def state(self) -> dict[str, Any]:
        """Return all that changes, as plain values."""
        counter = self.counter
        return {
            "counter": [counter.received, counter.lost, counter.out_of_order, counter.repeated, counter.next],
            "gaps": [list(gap) for gap in counter.gaps],
            "last_ns": self.last_ns,
            "still_since_ns": self.still_since_ns,
            "batch_ns": self.batch_ns,
            "filter": self._filter.state(),
            "blocks": self.timeline.state(),
            "last": None
            if self._last is None
            else np.hstack([one[-SIDE:] for one in self._last]).ravel().tolist(),
            "disturbed_since": self._disturbed_since,
            "settled_ns": self._settled_ns,
            "restarts": self.restarts,
            "reboots": self.reboots,
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Go on as the track whose state this is would have."""
        self.counter = SequenceCounter(*state["counter"])
        self.counter.gaps = [(first, end) for first, end in state["gaps"]]
        self.last_ns, self.still_since_ns = state["last_ns"], state["still_since_ns"]
        self.batch_ns, self.restarts, self.reboots = state["batch_ns"], state["restarts"], state["reboots"]
        self._filter.restore(state["filter"])
        self.timeline.restore(state["blocks"])
        last = None if state["last"] is None else np.reshape(state["last"], (-1, 6))
        self._last = None if last is None else (last[:, :3], last[:, 3:])
        self._disturbed_since, self._settled_ns = state["disturbed_since"], state["settled_ns"]


def _newest(last: tuple[Floats, Floats] | None, gyr: Floats, acc: Floats) -> tuple[Floats, Floats]:
    """Return the last samples there are."""
    if last is None:
        return gyr, acc
    return np.vstack([last[0][-SIDE:], gyr])[-SIDE:], np.vstack([last[1][-SIDE:], acc])[-SIDE:]
