"""An arm from the network to the machine: skeletons are heard, frames go out at their own rate."""

import logging
import threading
import time
from collections import Counter
from typing import TypeVar

from brachium_nodes.can.arm_frames import ArmValue, Reason, classic_frames, fd_frame
from brachium_nodes.can.arm_output import ArmOutput
from brachium_nodes.can.joint_table import IDS, JointTable
from brachium_nodes.can.own_ids import OtherSender, OwnIds
from brachium_nodes.can.port import Port
from brachium_wire import keys
from brachium_wire.bus import Bus
from brachium_wire.codec import WireError, decode
from brachium_wire.hosttime import HostClock, NoHostTime, follow_host_time
from brachium_wire.messages import Calibration, Info, Message, Origin, Skeleton

log = logging.getLogger(__name__)
T = TypeVar("T", bound=Message)

FOLLOW_S = 10.0
"""How often the host is asked anew for its time: two hosts drift apart by less than a ms meanwhile."""
RETRY_S = 0.5
LISTEN_S = 0.25
"""For so long nothing is sent: an arm that is on the bus already, at 20 Hz or more, is heard before."""


class ArmSender:
    """One arm of one subject. `tick` when a frame is due; `hear` what comes; `close` at the end."""

    def __init__(
        self,
        bus: Bus,
        room: str,
        table: JointTable,
        origins: frozenset[Origin],
        *,
        fd: bool,
        echoes: bool,
    ) -> None:
        self._bus, self._room, self._table, self._fd = bus, room, table, fd
        self._output, self._origins = ArmOutput(table, origins), origins
        self._ids = OwnIds(range(table.first_id, table.first_id + IDS), echoes=echoes)
        self._begin_s = time.monotonic() + LISTEN_S
        self._skeletons = bus.subscribe(keys.skeleton(room, table.subject, table.side), capacity=64)
        place = keys.calibration(room, table.subject)
        self._calibrations = bus.subscribe(place, capacity=16)
        self._clock: HostClock | None = None
        self._alive = 0
        self._arrived_ns = 0
        self._said: tuple[Reason | None, tuple[str, ...]] = (None, ())
        self._ended = threading.Event()
        self.counts: Counter[str] = Counter()
        self.drops: Counter[str] = Counter()
        self._follower = threading.Thread(target=self._follow_host, daemon=True)
        self._follower.start()

    def tick(self, port: Port) -> None:
        """Take what came and send the arm's next frames."""
        now_ns = time.monotonic_ns()
        for calibration in self._decoded(self._calibrations.drain(), Calibration):
            self._output.hear(calibration)
        for skeleton in self._decoded(self._skeletons.drain(), Skeleton):
            self._output.take(skeleton)
            self._arrived_ns = now_ns
        clock = self._clock
        value = self._output.value(None if clock is None else clock.at(now_ns), now_ns - self._arrived_ns)
        self._alive = (self._alive + 1) % 16
        self._send(port, value)
        self._tell(value)

    def hear(self, number: int, data: bytes | bytearray) -> None:
        """Look at a frame that came. Raises OtherSender when it has one of this arm's ids."""
        if self._ids.is_strange(number, data):
            raise OtherSender(
                f"somebody else on the bus sends {number:#x}, an id of the {self._table.side} arm of "
                f"{self._table.subject}: nothing more goes out from here; end the other one, or give this "
                "arm ids of its own with base_id"
            )

    def close(self) -> None:
        """End the thread that asks for the time."""
        self._ended.set()
        self._follower.join(2.0)

    def _send(self, port: Port, value: ArmValue) -> None:
        if time.monotonic() < self._begin_s:
            return
        first = self._table.first_id
        alive = self._alive
        frames = [fd_frame(first, alive, value)] if self._fd else classic_frames(first, alive, value)
        for number, data in frames:
            if port.send(number, data, fd=self._fd):
                self._ids.sent(number, data)
        self.counts["arm_frames"] += 1
        valid = sum(joint.reason is Reason.VALID for joint in value.joints)
        self.counts["valid_joints"] += valid
        self.counts["invalid_joints"] += len(value.joints) - valid

    def _tell(self, value: ArmValue) -> None:
        """Log what holds for the whole arm, when it changes."""
        reasons = {joint.reason for joint in value.joints}
        said = (reasons.pop() if len(reasons) == 1 else None, tuple(self._output.jumped))
        if said == self._said:
            return
        before, self._said = self._said, said
        who = f"{self._table.side} arm of {self._table.subject}"
        if said[0] is Reason.ORIGIN:
            allowed = ", ".join(sorted(self._origins))
            log.warning(
                "%s is %s: nothing of it is valid; only %s may go out (--origin)", who, value.origin, allowed
            )
        elif said[1] and said[1] != before[1]:
            log.warning(
                "%s: %s jumped as no arm moves; zero or calibrate to go on", who, " and ".join(said[1])
            )
        elif said[0] is Reason.SILENT:
            log.warning("%s: no skeletons; frames say invalid", who)
        elif before[0] is not None:
            log.info("%s: %s", who, "valid again" if said[0] is not Reason.STALE else "skeletons are too old")

    def _decoded(self, arrived: list[tuple[str, bytes]], kind: type[T]) -> list[T]:
        result: list[T] = []
        for _, payload in arrived:
            try:
                result.append(decode(payload, kind))
            except WireError as error:
                self.drops[error.drop.value] += 1
        return result

    def _follow_host(self) -> None:
        """Keep the clock that the skeletons' times are told by: their host's."""
        place = keys.subjects(self._room, "imu/*/info", self._table.subject)
        wait_s = 0.0
        while not self._ended.wait(wait_s):
            wait_s = RETRY_S
            try:
                for _, payload in self._bus.fetch(place):
                    host = decode(payload, Info).host
                    self._clock = follow_host_time(self._bus, self._room, host)
                    wait_s = FOLLOW_S
                    break
            except (NoHostTime, WireError) as error:
                log.debug("the host's time is not known yet: %s", error)
            except Exception:  # a bus that is being closed raises what it likes
                if not self._ended.is_set():
                    log.exception("asking for the host's time")
