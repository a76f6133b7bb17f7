"""Who may join and who is there: datagrams and times in, what is to be done out. Pure."""

from collections import Counter
from collections.abc import Callable

from brachium_nodes.node_frames import Hello
from brachium_nodes.roster import Refusal, Roster
from brachium_nodes.slimevr import answers, streaming
from brachium_nodes.slimevr import records as r
from brachium_nodes.slimevr.actions import Action, Joined, Left, Send, Told
from brachium_nodes.slimevr.allowed import RATE_HZ, AllowList, node_id, usual_mounting
from brachium_nodes.slimevr.datagrams import read
from brachium_nodes.slimevr.positions import chip
from brachium_nodes.slimevr.tracker import Address, Sensor, Tracker

NO_TOKEN = "0" * 64
"""A tracker has no token: its MAC address alone names it."""
GONE_NS = 3_000_000_000
"""A tracker that said nothing for so long is gone; its own patience with a server is as long."""
STATUS_NS = 1_000_000_000
KNOCK_NS = 5_000_000_000
"""Between two tries of a sensor whose segment was taken."""
SENSOR_LISTED_FROM = 9
"""Trackers of earlier protocols have one sensor and do not tell of it."""


class Trackers:
    """The state of all trackers. `other_host` says which other host a subject comes in through, or None."""

    def __init__(
        self, allowed: AllowList, roster: Roster, host: str, other_host: Callable[[str], str | None]
    ) -> None:
        self.allowed, self._roster, self._host, self._other_host = allowed, roster, host, other_host
        self._trackers: dict[str, Tracker] = {}
        self._at: dict[Address, Tracker] = {}
        self._status_ns = self._knock_ns = 0
        self.drops: Counter[str] = Counter()
        self.counts: Counter[str] = Counter()

    def receive(self, data: bytes, address: Address, now_ns: int) -> list[Action]:
        """Take a datagram that came from `address` at host time `now_ns`."""
        datagram = read(data)
        if datagram.records and isinstance(datagram.records[0], r.Handshake):
            return self._greet(datagram.records[0], address, now_ns)
        tracker = self._at.get(address)
        if tracker is None:
            self.drops["stranger"] += 1
            return []
        self.drops.update(drop.value for drop in datagram.drops)
        tracker.heard_ns = now_ns
        lost = tracker.take_number(datagram.number)
        if lost is None:
            self.drops["out_of_order"] += 1
            return []
        self.counts["datagrams"] += 1
        self.counts["datagrams_lost"] += lost
        actions: list[Action] = []
        for record in datagram.records:
            if isinstance(record, r.SensorInfo):
                actions.append(Send(address, answers.known(record.sensor, record.status)))
                actions += self._know(tracker, record, now_ns)
            else:
                actions += streaming.take(tracker, record, now_ns, self.counts, self.drops)
        return actions + streaming.samples(tracker, datagram, lost, now_ns, self.drops)

    def tick(self, now_ns: int) -> list[Action]:
        """Do what time asks for: questions, status, the end of patience. Call it every 10 to 50 ms."""
        actions: list[Action] = []
        for tracker in list(self._trackers.values()):
            if now_ns - tracker.heard_ns > GONE_NS:
                actions += self._end(tracker, now_ns)
            else:
                actions += streaming.ask(tracker, now_ns)
        if now_ns >= self._knock_ns:
            self._knock_ns = now_ns + KNOCK_NS
            for tracker in self._trackers.values():
                for sensor in tracker.sensors.values():
                    actions += self._admit(tracker, sensor, now_ns)
        if now_ns >= self._status_ns:
            self._status_ns = now_ns + STATUS_NS
            for tracker in self._trackers.values():
                for sensor in tracker.sensors.values():
                    actions += streaming.status(tracker, sensor, now_ns)
        return actions

    def expel(self, now_ns: int, reason: str, *, subject: str | None = None) -> list[Action]:
        """Take all sensors from the bus, or those of one subject."""
        return [
            action
            for tracker in self._trackers.values()
            for sensor in tracker.sensors.values()
            if sensor.admission is not None and subject in (None, sensor.admission.subject)
            for action in self._leave(sensor, now_ns, reason, tracker)
        ]

    def reassign(self, node: str, now_ns: int) -> list[Action]:
        """Let a sensor, whose place in the allow-list changed, take its new one."""
        for tracker in self._trackers.values():
            for sensor in tracker.sensors.values():
                if sensor.node == node:
                    return [
                        *self._leave(sensor, now_ns, "reassigned", tracker),
                        *self._admit(tracker, sensor, now_ns),
                    ]
        return []

    @property
    def subjects(self) -> set[str]:
        """Whose sensors come in here now."""
        found = (s.admission for t in self._trackers.values() for s in t.sensors.values())
        return {admission.subject for admission in found if admission is not None}

    @property
    def connected(self) -> int:
        """How many trackers are here now."""
        return len(self._trackers)

    # -- a tracker joins ---------------------------------------------------------------------------------

    def _greet(self, handshake: r.Handshake, address: Address, now_ns: int) -> list[Action]:
        mac = handshake.mac
        if mac is None:
            self.drops["no_mac"] += 1
            return []
        if mac not in self.allowed:
            self.drops["stranger"] += 1
            self._roster.admit(_hello(node_id(mac, 0), handshake), NO_TOKEN, None)
            return []
        tracker = self._trackers.get(mac)
        if tracker is None:
            tracker = self._trackers[mac] = Tracker(mac, handshake, address, now_ns)
        self._at.pop(tracker.address, None)
        tracker.handshake, tracker.address, tracker.heard_ns = handshake, address, now_ns
        tracker.number, tracker.ask_ns = None, now_ns
        self._at[address] = tracker
        for sensor in tracker.sensors.values():
            sensor.orientation = None  # it may have restarted: what it said before says nothing of now
        self.counts["handshakes"] += 1
        actions: list[Action] = [Send(address, answers.WELCOME)]
        if not handshake.firmware or (handshake.protocol or 0) < SENSOR_LISTED_FROM:
            actions += self._know(tracker, r.SensorInfo(0, 1, handshake.imu), now_ns)
        return actions

    def _know(self, tracker: Tracker, info: r.SensorInfo, now_ns: int) -> list[Action]:
        """Take what a sensor says of itself."""
        sensor = tracker.sensors.get(info.sensor)
        if sensor is None:
            sensor = tracker.sensors[info.sensor] = Sensor(node_id(tracker.mac, info.sensor), info)
        changed, sensor.info = sensor.info != info, info
        if info.status != 1 or not info.rotates:
            return self._leave(sensor, now_ns, f"its sensor says status {info.status}", tracker)
        if sensor.admission is not None and changed:
            return [streaming.info(tracker, sensor, self._host)]
        return self._admit(tracker, sensor, now_ns)

    def _admit(self, tracker: Tracker, sensor: Sensor, now_ns: int) -> list[Action]:
        info, roster = sensor.info, self._roster
        if sensor.admission is not None or info.status != 1 or not info.rotates:
            return []
        allowed = self.allowed.of(tracker.mac, info.sensor, info.position)
        hello = _hello(sensor.node, tracker.handshake, info, allowed.rate_hz if allowed else RATE_HZ)
        other = self._other_host(allowed.subject) if allowed is not None else None
        if allowed is not None and allowed.segment is not None:
            if roster.place_of(sensor.node) is None:
                roster.admit(hello, NO_TOKEN, other)  # it waits now, and can be assigned
            if roster.place_of(sensor.node) != (allowed.subject, allowed.segment):
                mounting = allowed.mounting or usual_mounting(allowed.segment)
                taken = roster.assign(sensor.node, allowed.subject, allowed.segment, mounting)
                if taken:
                    return self._refuse(sensor, Refusal("segment_taken", taken))
        answer = roster.admit(hello, NO_TOKEN, other)
        if isinstance(answer, Refusal):
            return self._refuse(sensor, answer)
        sensor.admission, sensor.hello, sensor.told = answer, hello, ""
        sensor.orientation = None
        sensor.counted_ns, sensor.counted = now_ns, answer.memory.counter.received
        return [
            Joined(sensor.node, answer.subject, answer.segment),
            streaming.info(tracker, sensor, self._host),
        ]

    def _refuse(self, sensor: Sensor, refusal: Refusal) -> list[Action]:
        self.counts["refused"] += 1
        if sensor.told == refusal.reason:
            return []
        sensor.told = refusal.reason
        return [Told(f"tracker {sensor.node} waits: {refusal.reason}")]

    # -- and leaves --------------------------------------------------------------------------------------

    def _end(self, tracker: Tracker, now_ns: int) -> list[Action]:
        actions: list[Action] = []
        for sensor in tracker.sensors.values():
            actions += self._leave(sensor, now_ns, "it fell silent", tracker)
        del self._trackers[tracker.mac]
        self._at.pop(tracker.address, None)
        return actions

    def _leave(self, sensor: Sensor, now_ns: int, reason: str, tracker: Tracker) -> list[Action]:
        admission = sensor.admission
        if admission is None:
            return []
        last = streaming.status(tracker, sensor, now_ns, connected=False)
        sensor.admission = None
        self._roster.leave(sensor.node)
        return [*last, Left(sensor.node, admission.subject, reason)]


def _hello(
    node: str, handshake: r.Handshake, info: r.SensorInfo | None = None, rate_hz: float = RATE_HZ
) -> Hello:
    """Return what a wearable of ours would have said of itself."""
    return Hello(
        node=node,
        boot=0,
        chip=chip(info.imu if info is not None else handshake.imu),
        rate_hz=rate_hz,
        firmware=handshake.firmware,
        orientation_only=True,
    )
