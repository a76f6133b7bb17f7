"""The recorder on a real bus: it begins with fusion's state, and loses nothing that it received."""

import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from types import SimpleNamespace

import pytest

from brachium_router import service as router
from brachium_router.config import RouterSettings
from brachium_viewer import recorder
from brachium_viewer.recorder import RecordReport, RecordSettings
from brachium_wire import keys, recording
from brachium_wire.bus import Bus
from brachium_wire.codec import decode, encode
from brachium_wire.messages import Answer, Calibration, Event, Health, Info, Session, Snapshot

ROOM = "gym"
INFO = encode(Info(node="n1", rate_hz=100.0, origin="emulated", host="h"))
SESSION = encode(Session())
STATE = encode(Snapshot(time_ns=1, settings={"rate": 50}, state=b"all of it"))


def event(number: int) -> bytes:
    return encode(Event(time_ns=number, kind="mark"))


def until(true: Callable[[], bool], seconds: float = 60.0) -> None:
    deadline = time.monotonic() + seconds
    while not true():
        assert time.monotonic() < deadline, "the deadline passed"
        threading.Event().wait(0.01)


@pytest.fixture(scope="module")
def endpoint(unused_port: Callable[[], int]) -> Iterator[str]:
    port = unused_port()
    stop = threading.Event()
    thread = threading.Thread(target=router.run, args=(RouterSettings(room=ROOM, port=port), stop))
    thread.start()
    yield f"tcp/127.0.0.1:{port}"
    stop.set()
    thread.join(15.0)
    assert not thread.is_alive()


class Running:
    """One recorder in a thread."""

    def __init__(self, settings: RecordSettings, bus: Bus) -> None:
        self.stop = threading.Event()
        self._pool = ThreadPoolExecutor(1)
        self._done: Future[RecordReport] = self._pool.submit(recorder.run, settings, self.stop)
        token = keys.alive(ROOM, "recorder", settings.id)
        until(lambda: token in bus.alive(token) or self._done.done())

    def end(self) -> RecordReport:
        self.stop.set()
        report = self._done.result(60.0)
        self._pool.shutdown()
        return report


@pytest.mark.network
def test_a_recording_begins_with_the_state_then_what_is_retained_then_all_that_comes(
    endpoint: str, tmp_path: Path
) -> None:
    with Bus.open(endpoint) as bus:
        bus.retain(keys.info(ROOM, "p01", "forearm_r"), INFO)
        bus.retain(keys.session(ROOM, "p01"), SESSION)
        asked = []

        def answer(key: str, question: bytes) -> bytes:
            asked.append((key, question))
            return encode(Answer(ok=True, data={"snapshot": STATE}))

        bus.serve(keys.commands(ROOM, "record"), answer)
        bus.serve(keys.commands(ROOM, "calibrate"), answer)
        running = Running(RecordSettings(endpoint=endpoint, room=ROOM, folder=tmp_path), bus)
        key = keys.event(ROOM, "p01")
        sent = [event(i) for i in range(500)]
        until(lambda: len(list(tmp_path.glob("*.mcap"))) == 1)
        for payload in sent:
            bus.put(key, payload)
        health = bus.subscribe(keys.service(ROOM, "recorder", "main"))
        until(lambda: any(decode(p, Health).counts.get("recorded", 0) >= 503 for _, p in health.drain()))
        report = running.end()
    assert [k for k, _ in asked] == [keys.command(ROOM, "p01", "record")]  # nothing else was set off
    reading = recording.read(report.path)
    messages = list(reading)
    assert reading.closed
    assert reading.metadata["room"] == ROOM
    assert [(m.key, m.payload) for m in messages[:1]] == [(keys.snapshot(ROOM, "p01"), STATE)]
    assert {(m.key, m.payload) for m in messages[1:3]} == {
        (keys.info(ROOM, "p01", "forearm_r"), INFO),
        (keys.session(ROOM, "p01"), SESSION),
    }
    assert [m.payload for m in messages if m.key == key] == sent
    assert report.messages["event"] == 500
    assert report.messages["snapshot"] == report.messages["info"] == report.messages["session"] == 1
    assert report.missing == {}
    assert report.dropped == {}


@pytest.mark.network
def test_without_fusion_and_with_one_subject_only(endpoint: str, tmp_path: Path) -> None:
    with Bus.open(endpoint) as bus:
        bus.retain(keys.calibration(ROOM, "p02"), encode(Calibration(time_ns=1, state="none")))
        bus.retain(keys.calibration(ROOM, "p03"), encode(Calibration(time_ns=1, state="none")))
        settings = RecordSettings(endpoint=endpoint, room=ROOM, folder=tmp_path, subject="p02", id="r2")
        running = Running(settings, bus)
        until(lambda: len(list(tmp_path.glob("p02-*.mcap"))) == 1)
        health = bus.subscribe(keys.service(ROOM, "recorder", "r2"))
        bus.put(keys.event(ROOM, "p03"), event(1))
        bus.put(keys.event(ROOM, "p02"), event(2))
        until(lambda: any(decode(p, Health).counts.get("recorded", 0) >= 2 for _, p in health.drain()))
        report = running.end()
    subjects = {keys.parse(m.key).subject for m in recording.read(report.path)}
    assert subjects <= {"p02", keys.SERVICE}
    assert report.messages["event"] == report.messages["calibration"] == 1


@pytest.mark.network
def test_the_time_given_ends_it(endpoint: str, tmp_path: Path) -> None:
    settings = RecordSettings(endpoint=endpoint, room=ROOM, folder=tmp_path, seconds=0.0, id="r3")
    report = recorder.run(settings, threading.Event())
    assert report.missing == {}
    assert recording.is_closed(report.path)


@pytest.mark.network
def test_a_recorder_without_room_to_begin_is_never_announced(
    endpoint: str, tmp_path: Path, disk: SimpleNamespace, monkeypatch: pytest.MonkeyPatch
) -> None:
    announced: list[str] = []

    def announce(_bus: Bus, key: str) -> Callable[[], None]:
        announced.append(key)
        return lambda: None

    monkeypatch.setattr(Bus, "announce", announce)
    disk.room = 0
    with pytest.raises(OSError, match="No space left"):
        recorder.run(RecordSettings(endpoint=endpoint, room=ROOM, folder=tmp_path), threading.Event())
    assert announced == []  # who waits for the token would take it for a recording


def test_what_is_not_recorded_is_counted_by_name(tmp_path: Path) -> None:
    with recording.RecordingWriter(tmp_path / "a.mcap") as writer:
        one = recorder.Recorder(writer)
        one.take("brachium/gym/p01/nonsense", b"", 1)
        one.take(keys.event(ROOM, "p01"), bytes(1 << 20), 2)
        one.take(keys.command(ROOM, "p01", "zero"), b"", 3)  # the table says that commands are not recorded
        one.take(keys.alive(ROOM, "fusion", "main"), b"", 4)
        one.take(keys.event(ROOM, "p01"), event(1), 5)
    report = one.report()
    assert report.messages == {"event": 1}
    assert report.dropped == {"bad_key": 1, "oversize": 1}
    assert report.missing == {}


def test_a_file_that_lacks_what_was_received_says_so(tmp_path: Path) -> None:
    with recording.RecordingWriter(tmp_path / "a.mcap") as writer:
        one = recorder.Recorder(writer)
        one.take(keys.event(ROOM, "p01"), event(1), 1)
        one.received[keys.event(ROOM, "p01")] += 2  # as if the disk had lost two
    assert one.report().missing == {keys.event(ROOM, "p01"): 2}


def test_files_that_a_crash_left_open_are_closed_and_counted(tmp_path: Path) -> None:
    with recording.RecordingWriter(tmp_path / "whole.mcap") as writer:
        for i in range(20):
            writer.write(keys.event(ROOM, "p01"), event(i), i * 200_000_000)
    content = (tmp_path / "whole.mcap").read_bytes()
    (tmp_path / "open.mcap").write_bytes(content[: len(content) // 2])
    (tmp_path / "other.mcap").write_bytes(b"of another program")
    reports = recorder.recover_folder(tmp_path)
    assert [r.path.name for r in reports] == ["open.mcap"]
    assert recording.counts(tmp_path / "open.mcap") == reports[0].messages
    assert 0 < sum(reports[0].messages.values()) < 20
    assert (tmp_path / "whole.mcap").read_bytes() == content
    assert (tmp_path / "other.mcap").read_bytes() == b"of another program"


def test_a_second_recording_of_the_same_second_gets_the_next_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from datetime import UTC, datetime

    class Still(datetime):
        @classmethod
        def now(cls, tz: object = None) -> datetime:  # type: ignore[override]
            del tz
            return datetime(2026, 1, 2, 3, 4, 5, tzinfo=UTC)

    monkeypatch.setattr(recorder, "datetime", Still)
    settings = RecordSettings(folder=tmp_path, room=ROOM)
    names = []
    for _ in range(3):
        with recorder._create(settings) as writer:
            names.append(writer.path.name)
    assert names == [
        "gym-2026-01-02T03-04-05Z.mcap",
        "gym-2026-01-02T03-04-05Z-2.mcap",
        "gym-2026-01-02T03-04-05Z-3.mcap",
    ]


def test_a_recording_that_another_recorder_still_writes_is_left_alone(tmp_path: Path) -> None:
    with recording.RecordingWriter(tmp_path / "open.mcap") as writer:
        for i in range(20):
            writer.write(keys.event(ROOM, "p01"), event(i), i * 200_000_000)
        assert recorder.recover_folder(tmp_path) == []
        writer.write(keys.event(ROOM, "p01"), event(20), 20 * 200_000_000)
    assert recording.counts(tmp_path / "open.mcap") == {keys.event(ROOM, "p01"): 21}


@pytest.mark.parametrize(
    "names", [{"subject": "../../evil"}, {"subject": "*"}, {"subject": "a/b"}, {"room": "../x"}, {"id": "/"}]
)
def test_a_name_that_is_no_name_touches_nothing(tmp_path: Path, names: dict[str, str]):
    folder = tmp_path / "in" / "recordings"
    with pytest.raises(keys.BadKey, match="cannot be used"):
        recorder.run(RecordSettings(folder=folder, **names), threading.Event())
    assert list(tmp_path.iterdir()) == []
