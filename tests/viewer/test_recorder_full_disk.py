"""A recorder whose disk is full: the file is whole, somebody is told, and everything else goes on."""

from pathlib import Path
from types import SimpleNamespace

import pytest

from brachium_viewer import recorder
from brachium_viewer.health import Network
from brachium_viewer.monitor import block, to_json
from brachium_viewer.web.page_state import PageState
from brachium_wire import keys, recording
from brachium_wire.codec import encode
from brachium_wire.messages import Event, Health

ROOM = "gym"
KEY = keys.event(ROOM, "p01")


def event(number: int) -> bytes:
    return encode(Event(time_ns=number, kind="mark"))


def fill(one: recorder.Recorder, count: int) -> None:
    for i in range(count):
        one.take(KEY, event(i), 1 + i * 50_000_000)


def test_it_ends_the_file_with_all_that_came_until_then(tmp_path: Path, disk: SimpleNamespace) -> None:
    disk.room, disk.reserve = 20_000, 1 << 20
    with recording.RecordingWriter(tmp_path / "a.mcap") as writer:
        one = recorder.Recorder(writer)
        fill(one, 2000)
    assert one.received[KEY] + one.drops["disk_full"] == 2000
    assert 20 < one.received[KEY] < 2000
    report = one.report()
    assert report.missing == {}
    assert report.messages == {"event": one.received[KEY]}
    assert recording.is_closed(report.path)
    assert [m.payload for m in recording.read(report.path)] == [event(i) for i in range(one.received[KEY])]
    assert report.ended == one.ended
    for words in ("No space left", "a.mcap", str(tmp_path), "Make room"):
        assert words in one.ended
    one.tick(1 << 60)  # nothing more happens to the file


def test_a_disk_that_is_full_for_good_leaves_what_it_took(tmp_path: Path, disk: SimpleNamespace) -> None:
    disk.room = 20_000
    with recording.RecordingWriter(tmp_path / "a.mcap") as writer:
        one = recorder.Recorder(writer)
        fill(one, 2000)
    report = one.report()
    assert "but for its index" in report.ended
    assert not recording.is_closed(report.path)
    found = report.messages["event"]
    assert one.received[KEY] - 11 <= found <= one.received[KEY]  # 0.5 s of one message each 50 ms
    assert [m.payload for m in recording.read(report.path)] == [event(i) for i in range(found)]
    assert report.missing == ({KEY: one.received[KEY] - found} if found < one.received[KEY] else {})


def test_monitor_and_page_show_the_alarm_in_words_while_the_recorder_is_there() -> None:
    said = "the disk takes no more; a.mcap holds what came until then"
    payload = encode(Health(kind="recorder", id="r1", time_ns=1, uptime_s=1.0, alarm=said))
    network, page = Network(), PageState(ROOM)
    for reader in (network, page):
        reader.feed(keys.service(ROOM, "recorder", "r1"), payload, 1)
    assert f"ALARM: recorder/r1: {said}" in block(network.report(2)).splitlines()
    assert said in to_json(network.report(2))
    assert page.state(2)["alarms"] == [{"what": "recording", "reason": said}]
    for token in (network.token, page.network.token):
        token(keys.alive(ROOM, "recorder", "r1"), False)
    assert "ALARM" not in block(network.report(2))
    assert page.state(2)["alarms"] == []
    for token in (network.token, page.network.token):  # another one of the same name has said nothing yet
        token(keys.alive(ROOM, "recorder", "r1"), True)
    assert "ALARM" not in block(network.report(3))
    assert page.state(3)["alarms"] == []


def test_a_page_leaves_its_own_recorders_alarm_to_the_session_that_knows_it_first() -> None:
    said = encode(Health(kind="recorder", id="r1", time_ns=1, uptime_s=1.0, alarm="the disk takes no more"))
    page = PageState(ROOM, own_recorder="r1")
    page.feed(keys.service(ROOM, "recorder", "r1"), said, 1)
    page.feed(keys.service(ROOM, "recorder", "r2"), said, 1)
    assert len(page.state(2)["alarms"]) == 1


def test_a_folder_without_room_to_begin_is_said_and_holds_nothing(
    tmp_path: Path, disk: SimpleNamespace
) -> None:
    disk.room = 0
    with pytest.raises(OSError, match="No space left"):
        recorder._create(recorder.RecordSettings(folder=tmp_path, room=ROOM))
    assert list(tmp_path.iterdir()) == []
