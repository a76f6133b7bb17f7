"""The fusion service on a real router: samples in, skeletons out, commands answered."""

import threading
import time
from collections.abc import Iterator

import msgspec
import numpy as np
import pytest

from brachium_body import rotation
from brachium_body.kinematics import TRUNK_FROM_NEUTRAL
from brachium_body.segments import arm_segments
from brachium_fusion.pipeline import Pipeline
from brachium_fusion.service import FuseSettings, run
from brachium_fusion.settings import Settings
from brachium_wire import keys
from brachium_wire.bus import Bus
from brachium_wire.codec import decode, decode_topic, encode
from brachium_wire.messages import Answer, Calibration, Command, Event, Health, Session, Skeleton, Snapshot

pytestmark = pytest.mark.network

SUBJECT, DEADLINE_S = "p01", 60.0
PIECE = 24
"""Messages put at once: a room spreads over seconds what a test has at hand at once, and a stream on the bus
drops what finds its queue full."""


@pytest.fixture
def bus(endpoint: str) -> Iterator[Bus]:
    with Bus.open(endpoint) as bus:
        yield bus


class Fusion:
    """The service in a thread, and what a client of the room hears of it."""

    def __init__(self, endpoint: str, bus: Bus, room: str, **chosen) -> None:
        self.stop = threading.Event()
        self.error: BaseException | None = None
        self._bus, self._room = bus, room
        self._inbox = bus.subscribe(keys.everything(room))
        self.skeletons: list[Skeleton] = []
        self.calibrations: list[Calibration] = []
        self.events: list[Event] = []
        self.health = Health(kind="", id="", time_ns=0, uptime_s=0.0)
        settings = FuseSettings(endpoint=endpoint, room=room, pipeline=Settings(**chosen))
        self._pipeline = Pipeline(settings.pipeline)
        """It is given what the service is given, and so knows how many skeletons are due."""
        self._due = 0
        self._thread = threading.Thread(target=self._run, args=(settings,))
        self._thread.start()
        self.until(lambda: self.health.kind == "fusion", "the first health")

    def _run(self, settings: FuseSettings) -> None:
        try:
            run(settings, self.stop)
        except BaseException as error:  # told by `until` and `end`
            self.error = error

    def put(self, messages) -> None:
        """Put messages of sensors, each piece once all skeletons of the piece before were heard."""
        for first in range(0, len(messages), PIECE):
            piece = messages[first : first + PIECE]
            for key, payload in piece:
                if key.topic == "info":
                    self._bus.retain(keys.info(self._room, SUBJECT, key.detail), payload)
                else:
                    self._bus.put(keys.imu(self._room, SUBJECT, key.detail), payload)
            self.expect(piece)
            self.until(lambda: len(self.skeletons) >= self._due, "the skeletons of a piece")

    def expect(self, messages) -> None:
        """Count the skeletons due of messages that the service has or gets."""
        self._pipeline.feed_all(messages)
        self._due += len(self._pipeline.skeletons())

    def listen(self) -> None:
        for key, payload in self._inbox.drain():
            topic = keys.parse(key).topic
            if topic in ("imu", "info", "session"):
                continue
            message = decode_topic(payload, topic)
            if isinstance(message, Skeleton):
                self.skeletons.append(message)
            elif isinstance(message, Calibration):
                self.calibrations.append(message)
            elif isinstance(message, Event):
                self.events.append(message)
            elif isinstance(message, Health):
                self.health = message

    def until(self, condition, what: str) -> None:
        deadline = time.monotonic() + DEADLINE_S
        while True:
            assert self.error is None, self.error
            self.listen()
            if condition():
                return
            assert time.monotonic() < deadline, f"waited {DEADLINE_S:g} s for: {what}"
            self._inbox.wait(0.05)

    def end(self) -> None:
        self.stop.set()
        self._thread.join(timeout=DEADLINE_S)
        assert not self._thread.is_alive()
        assert self.error is None, self.error


@pytest.fixture
def fusion(endpoint: str, bus: Bus) -> Iterator:
    running: list[Fusion] = []

    def start(room: str, **chosen) -> Fusion:
        running.append(Fusion(endpoint, bus, room, **chosen))
        return running[-1]

    yield start
    for one in running:
        one.end()


def hanging(made, seconds: float, bend: float = 0.0):
    n = int(seconds * made.RATE)
    quats = {s: np.tile(TRUNK_FROM_NEUTRAL, (n, 1)) for s in arm_segments("right")}
    forearm = rotation.multiply(TRUNK_FROM_NEUTRAL, rotation.about(2, np.linspace(0.0, bend, n)))
    return quats | {"forearm_r": forearm, "hand_r": forearm}


def test_samples_become_skeletons_and_every_count_is_told(made, fusion) -> None:
    service = fusion("plain")
    quats = hanging(made, 4.0)
    messages = made.orientation_messages(quats)
    service.put(made.info_messages(quats) + messages)
    wanted = Pipeline()
    wanted.feed_all(made.info_messages(quats) + messages)
    expected = [solved.skeleton for solved in wanted.skeletons()]
    assert service.skeletons == expected
    service.until(lambda: service.health.counts.get("skeletons") == len(expected), "the count in health")
    assert service.health.counts["subjects"] == 1
    assert service.health.counts["batches"] == len(messages) + len(quats)
    assert service.health.drops == {}
    assert [c.state for c in service.calibrations] == ["done"]


def test_fusion_tells_each_subjects_recording_how_it_solves(made, fusion) -> None:
    service = fusion("told", filter="complementary", magnetometer=False, rate_hz=25.0)
    quats = hanging(made, 0.5)
    service.put(made.info_messages(quats) + made.orientation_messages(quats))
    service.until(lambda: any(e.kind == "settings" for e in service.events), "the settings")
    told = [Settings(**e.data) for e in service.events if e.kind == "settings"]
    assert told == [Settings(filter="complementary", magnetometer=False, rate_hz=25.0)]


def test_bad_bytes_and_sessions_are_counted_and_the_service_goes_on(made, fusion, bus) -> None:
    service = fusion("bad")
    quats = hanging(made, 1.0)
    messages = made.orientation_messages(quats)
    service.put(made.info_messages(quats) + messages[:10])
    for _ in range(3):
        bus.put(keys.imu("bad", SUBJECT, "hand_r"), b"\xc1")
    bus.put(keys.imu("bad", SUBJECT, "tail"), messages[0][1])
    bus.put(keys.session("bad", SUBJECT), encode(Session(lengths_m={"upper_arm": 2.9})))
    bus.put(keys.session("bad", SUBJECT), b"\x80")
    service.put(messages[10:])
    assert len(service.skeletons) >= 48
    service.until(lambda: sum(service.health.drops.values()) >= 10, "the drops in health")
    assert service.health.drops == {
        "malformed": 3,
        "unknown_segment": 5,
        "out_of_range": 1,
        "wrong_version": 1,
    }


def ask(bus: Bus, room: str, verb: str, arguments: dict) -> "Asked":
    return Asked(bus, keys.command(room, SUBJECT, verb), encode(Command(arguments=arguments)))


class Asked:
    """A question on its way."""

    def __init__(self, bus: Bus, key: str, question: bytes) -> None:
        self.answer: Answer | None = None
        self._bus, self._key, self._question = bus, key, question
        self._thread = threading.Thread(target=self._ask)
        self._thread.start()

    def _ask(self) -> None:
        payload = self._bus.ask(self._key, self._question, timeout_s=DEADLINE_S)
        assert payload is not None
        self.answer = decode(payload, Answer)

    def wait(self) -> Answer:
        self._thread.join(timeout=DEADLINE_S)
        assert self.answer is not None, "no answer came"
        return self.answer


def test_calibrate_is_answered_when_it_is_done_and_a_wrong_wish_at_once(made, fusion, bus) -> None:
    service = fusion("cal", auto_pose=False)
    assert "no sensor of subject" in ask(bus, "cal", "calibrate", {}).wait().reason
    quats = hanging(made, 4.0)
    messages = made.orientation_messages(quats)
    service.put(made.info_messages(quats) + messages[:30])
    refused = ask(bus, "cal", "calibrate", {"pose": "headstand"}).wait()
    assert not refused.ok
    assert "poses are n-pose" in refused.reason
    asked = ask(bus, "cal", "calibrate", {"seconds": 2})
    service.until(lambda: any(e.text == "calibrate" for e in service.events), "the command applied")
    service.put(messages[30:])
    answer = asked.wait()
    assert answer.ok
    assert "sway_deg_forearm_r" in answer.data["scores"]
    service.until(lambda: [c.state for c in service.calibrations] == ["waiting", "done"], "both states")
    (retained,) = bus.fetch(keys.calibration("cal", SUBJECT), timeout_s=DEADLINE_S)
    assert decode_topic(retained[1], "calibration") == service.calibrations[-1]


def test_calibrate_is_refused_with_the_name_of_who_moved(made, fusion, bus) -> None:
    service = fusion("move", auto_pose=False)
    quats = hanging(made, 40.0)
    n = len(quats["hand_r"])
    wave = rotation.about(0, 0.5 * np.sin(np.arange(n) / 30.0))
    quats["hand_r"] = rotation.multiply(quats["hand_r"], wave)
    messages = made.orientation_messages(quats, batch=50)
    service.put(made.info_messages(quats) + messages[:6])
    asked = ask(bus, "move", "calibrate", {"seconds": 2})
    service.until(lambda: any(e.text == "calibrate" for e in service.events), "the command applied")
    service.put(messages[6:])
    answer = asked.wait()
    assert not answer.ok
    assert "hand_r was not still" in answer.reason


def test_who_waits_for_a_calibration_is_told_when_fusion_stops(made, fusion, bus) -> None:
    service = fusion("wait", auto_pose=False)
    quats = hanging(made, 1.0)
    service.put(made.info_messages(quats) + made.orientation_messages(quats))
    asked = ask(bus, "wait", "calibrate", {})
    service.until(lambda: any(e.text == "calibrate" for e in service.events), "the command applied")
    service.end()
    assert asked.wait().reason == "fusion is stopping"


def test_record_answers_a_snapshot_from_which_fusion_goes_on(made, fusion, bus) -> None:
    service = fusion("rec")
    quats = hanging(made, 6.0, bend=1.0)
    messages = made.orientation_messages(quats)
    # Whole rounds of all sensors: the last message gives a skeleton, so nothing can come after the question.
    first = 66 * len(quats)
    service.put(made.info_messages(quats) + messages[:first])
    known = len(service.skeletons)
    assert known >= 160
    answer = ask(bus, "rec", "record", {}).wait()
    assert answer.ok
    pipeline = Pipeline()
    pipeline.restore(SUBJECT, decode(answer.data["snapshot"], Snapshot))
    service.put(messages[first:])
    pipeline.feed_all(messages[first:])
    again = [solved.skeleton for solved in pipeline.skeletons()]
    assert len(again) > 100
    assert service.skeletons[known:] == again


def test_fusion_that_starts_late_learns_what_is_retained(made, fusion, bus) -> None:
    quats = hanging(made, 1.0)
    infos = made.info_messages(quats)
    for key, payload in infos:
        bus.retain(keys.info("late", SUBJECT, key.detail), payload)
    bus.retain(keys.session("late", SUBJECT), encode(Session(height_m=1.5)))
    service = fusion("late")
    service.expect(infos)
    service.put(made.orientation_messages(quats))
    assert len(service.skeletons) >= 48
    assert service.skeletons[0].positions["shoulder"][0] == pytest.approx(0.129 * 1.5)
    applied = [e for e in service.events if e.kind == "applied"]
    assert [e.text for e in applied] == ["session"]
    assert msgspec.convert(applied[0].data, Session).height_m == 1.5
