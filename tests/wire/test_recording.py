"""Recordings: what was written is what is read, in order, and a cut costs only what came after it."""

import itertools
import os
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any, cast

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mcap.reader import make_reader
from mcap.stream_reader import StreamReader

from brachium_wire import keys, messages, recording, schema
from brachium_wire.codec import decode_topic, encode
from brachium_wire.topics import TOPICS

KEYS = [
    keys.imu("gym", "p01", "forearm_r"),
    keys.info("gym", "p01", "forearm_r"),
    keys.skeleton("gym", "p01", "right"),
    keys.snapshot("gym", "p01"),
    keys.service("gym", "fusion", "main"),
]
SECOND = 1_000_000_000


def write(
    path: Path, count: int, step_ns: int = 100_000_000, metadata: dict[str, str] | None = None
) -> list[recording.Recorded]:
    written = []
    with recording.RecordingWriter(path, metadata or {}) as writer:
        for i in range(count):
            one = recording.Recorded(KEYS[i % len(KEYS)], b"payload %d " % i * 20, SECOND + i * step_ns)
            writer.write(*one)
            written.append(one)
    return written


def test_what_was_written_is_read_in_order_and_unchanged(tmp_path: Path) -> None:
    written = write(tmp_path / "a.mcap", 57, metadata={"origin": "emulated"})
    reading = recording.read(tmp_path / "a.mcap")
    assert reading.metadata == {"origin": "emulated"}
    assert list(reading) == written
    assert reading.closed
    assert reading.warning == ""


@given(
    items=st.lists(
        st.tuples(st.sampled_from(KEYS), st.binary(max_size=300), st.integers(0, 1 << 62)), max_size=40
    )
)
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=40, deadline=None)
def test_any_bytes_and_times_keep_their_order(tmp_path: Path, items: list[tuple[str, bytes, int]]) -> None:
    path = tmp_path / "any.mcap"
    path.unlink(missing_ok=True)
    with recording.RecordingWriter(path) as writer:
        for item in items:
            writer.write(*item)
    read = list(recording.read(path))
    assert [(key, payload) for key, payload, _ in read] == [(key, payload) for key, payload, _ in items]
    times = [message.log_time_ns for message in read]
    assert all(a < b for a, b in itertools.pairwise(times))
    with path.open("rb") as file:  # an independent, indexed reader sorts by time and must find the same order
        judged = [(c.topic, m.data) for _, c, m in make_reader(file).iter_messages()]
    assert judged == [(key, payload) for key, payload, _ in items]


def test_another_reader_finds_channels_schemas_and_statistics(tmp_path: Path) -> None:
    write(tmp_path / "a.mcap", 50, metadata={"room": "gym"})
    with (tmp_path / "a.mcap").open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        found = reader.get_summary()
        assert found is not None
        assert found.statistics is not None
        assert found.statistics.message_count == 50
        assert sorted(c.topic for c in found.channels.values()) == sorted(KEYS)
        assert {c.message_encoding for c in found.channels.values()} == {"msgpack"}
        by_name = {s.name: s.data.decode() for s in found.schemas.values()}
        assert set(by_name) == {"imu/1", "info/1", "skeleton/1", "snapshot/1", "health/1"}
        assert [m.metadata for m in reader.iter_metadata()] == [{"room": "gym"}]
    assert "n x 3 f32: specific force" in by_name["imu/1"]
    with (tmp_path / "a.mcap").open("rb") as file:
        assert (
            sum(type(r).__name__ == "Message" for r in StreamReader(file, validate_crcs=True).records) == 50
        )


@pytest.mark.parametrize("topic", sorted(TOPICS))
def test_a_schema_names_every_field_of_its_message(topic: str) -> None:
    kind = TOPICS[topic].message
    text = schema.text(kind)
    for name in kind.__struct_encode_fields__:
        assert f"\n  {name}: " in text
    assert "SegmentPose" not in text or "\nSegmentPose: " in text


def test_a_recording_is_never_overwritten(tmp_path: Path) -> None:
    write(tmp_path / "a.mcap", 5)
    before = (tmp_path / "a.mcap").read_bytes()
    with pytest.raises(FileExistsError):
        recording.RecordingWriter(tmp_path / "a.mcap")
    assert (tmp_path / "a.mcap").read_bytes() == before


def test_a_key_of_no_topic_is_refused_and_the_file_stays_whole(tmp_path: Path) -> None:
    with recording.RecordingWriter(tmp_path / "a.mcap") as writer:
        writer.write(KEYS[0], b"x", 1)
        for bad in ("elsewhere/a", "brachium/gym/p01/thing", keys.alive("gym", "fusion", "main")):
            with pytest.raises(keys.BadKey):
                writer.write(bad, b"x", 2)
        writer.write(KEYS[0], b"y", 3)
    assert [m.payload for m in recording.read(tmp_path / "a.mcap")] == [b"x", b"y"]


def test_a_message_comes_back_as_it_was(tmp_path: Path) -> None:
    event = messages.Event(time_ns=5, kind="note", text="begin", data={"repetition": 3})
    with recording.RecordingWriter(tmp_path / "a.mcap") as writer:
        writer.write(keys.event("gym", "p01"), encode(event), 5)
    (one,) = recording.read(tmp_path / "a.mcap")
    assert decode_topic(one.payload, keys.parse(one.key).topic) == event


def test_half_a_second_is_on_file_before_the_end(tmp_path: Path) -> None:
    with recording.RecordingWriter(tmp_path / "a.mcap") as writer:
        for i in range(20):
            writer.write(KEYS[0], b"%d" % i, SECOND + i * 100_000_000)
        seen = len(list(recording.read(tmp_path / "a.mcap")))
        assert 15 <= seen <= 20
        writer.tick(10 * SECOND)  # nothing more comes, time goes on
        assert len(list(recording.read(tmp_path / "a.mcap"))) == 20


@given(fraction=st.floats(0.0, 1.0))
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=60, deadline=None)
def test_a_file_cut_anywhere_reads_up_to_the_cut_and_recovers(tmp_path: Path, fraction: float) -> None:
    whole, cut = tmp_path / "whole.mcap", tmp_path / "cut.mcap"
    if not whole.exists():
        write(whole, 200)
    written = list(recording.read(whole))
    data = whole.read_bytes()
    keep = int(fraction * len(data))
    cut.write_bytes(data[:keep])
    if not recording.is_recording(cut):
        assert keep < 200  # only when header and metadata are not whole
        with pytest.raises(recording.RecordingError):
            recording.read(cut)
        return
    reading = recording.read(cut)
    read = list(reading)
    assert read == written[: len(read)]
    assert (reading.warning == "") == reading.closed == (keep == len(data))
    report = recording.recover(cut)
    assert report.recovered == (keep < len(data))
    assert sum(report.messages.values()) == len(read)
    again = recording.read(cut)
    assert list(again) == read
    assert again.closed
    assert again.warning == ""
    with cut.open("rb") as file:
        found = make_reader(file, validate_crcs=True).get_summary()
    assert found is not None
    assert found.statistics is not None
    assert found.statistics.message_count == len(read)


@given(data=st.data())
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=60, deadline=None)
def test_damage_anywhere_raises_nothing_and_invents_nothing(tmp_path: Path, data: st.DataObject) -> None:
    whole, hurt = tmp_path / "whole.mcap", tmp_path / "hurt.mcap"
    if not whole.exists():
        write(whole, 100)
    written = set(recording.read(whole))
    content = bytearray(whole.read_bytes())
    at = data.draw(st.integers(0, len(content) - 1))
    content[at : at + 8] = data.draw(st.binary(min_size=1, max_size=8))
    hurt.write_bytes(bytes(content))
    try:
        read = list(recording.read(hurt))
    except recording.RecordingError:
        assert at < 200
        return
    assert {m.payload for m in read} <= {m.payload for m in written}


def test_one_damaged_block_costs_only_itself(tmp_path: Path) -> None:
    written = write(tmp_path / "a.mcap", 100)
    with (tmp_path / "a.mcap").open("rb") as file:
        found = make_reader(file).get_summary()
    assert found is not None
    middle = found.chunk_indexes[len(found.chunk_indexes) // 2]
    content = bytearray((tmp_path / "a.mcap").read_bytes())
    content[middle.chunk_start_offset + middle.chunk_length - 5] ^= 0xFF
    (tmp_path / "a.mcap").write_bytes(bytes(content))
    reading = recording.read(tmp_path / "a.mcap")
    read = list(reading)
    assert "1 damaged block" in reading.warning
    expected = [
        m for m in written if not middle.message_start_time <= m.log_time_ns <= middle.message_end_time
    ]
    assert read == expected
    assert len(read) < len(written)


def test_a_zero_filled_tail_is_a_cut(tmp_path: Path) -> None:
    written = write(tmp_path / "a.mcap", 100)
    content = (tmp_path / "a.mcap").read_bytes()
    keep = len(content) // 2
    (tmp_path / "a.mcap").write_bytes(content[:keep] + bytes(len(content) - keep))
    assert recording.recover(tmp_path / "a.mcap").recovered
    read = list(recording.read(tmp_path / "a.mcap"))
    assert 0 < len(read) < 100
    assert read == written[: len(read)]


WRITER = """
import sys
from pathlib import Path
from brachium_wire import keys, recording
writer = recording.RecordingWriter(Path(sys.argv[1]), {"origin": "emulated"})
key, i = keys.imu("gym", "p01", "forearm_r"), 0
while True:
    writer.write(key, b"%d" % i, 1_000_000_000 + i * 20_000_000)
    i += 1
    if i % 50 == 0:
        print(i, flush=True)
"""


def test_a_killed_writer_loses_half_a_second_at_most(tmp_path: Path) -> None:
    path = tmp_path / "killed.mcap"
    env = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    with subprocess.Popen(
        [sys.executable, "-c", WRITER, str(path)], stdout=subprocess.PIPE, env=env
    ) as process:
        assert process.stdout is not None
        said = 0
        while said < 1000:
            said = int(process.stdout.readline())
        with pytest.raises(recording.RecordingError, match="is being written"):
            recording.recover(path)
        process.send_signal(signal.SIGKILL)
        process.wait(60)
    assert not recording.is_closed(path)
    report = recording.recover(path)
    assert report.recovered
    reading = recording.read(path)
    payloads = [m.payload for m in reading]
    assert payloads == [b"%d" % i for i in range(len(payloads))]
    assert len(payloads) >= said - 26  # 0.5 s of the caller's time
    assert reading.closed
    assert reading.metadata == {"origin": "emulated", "recovered": "true"}
    assert not list(tmp_path.glob("*.recovering"))


@pytest.mark.parametrize("content", [b"", b"time,a\n1,2\n", b"PAR1" + bytes(40), b"\x89MCAP0\r\n"])
def test_a_foreign_file_gives_one_clear_line(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "x.mcap").write_bytes(content)
    assert not recording.is_recording(tmp_path / "x.mcap")
    with pytest.raises(recording.RecordingError) as caught:
        recording.read(tmp_path / "x.mcap")
    assert "x.mcap" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_an_mcap_file_of_another_program_is_refused_by_name(tmp_path: Path) -> None:
    from mcap import writer

    with (tmp_path / "ros.mcap").open("wb") as file:
        other = cast(Any, writer.Writer)(file)
        other.start(profile="ros2")
        other.finish()
    with pytest.raises(recording.RecordingError, match=r"another program.*ros2"):
        recording.read(tmp_path / "ros.mcap")


FULL = """
import random, resource, signal, sys
from pathlib import Path
from brachium_wire import keys, recording
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (2_000_000, 2_000_000))
written = 0
try:
    with recording.RecordingWriter(Path(sys.argv[1])) as writer:
        for i in range(10_000):
            payload = b"%d " % i + random.Random(i).randbytes(1000)
            writer.write(keys.imu("gym", "p01", "forearm_r"), payload, 1_000_000_000 + i * 20_000_000)
except OSError as error:
    print(error.strerror)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="limits of a process are POSIX")
def test_a_file_that_may_not_grow_is_said_and_what_was_written_is_read(tmp_path: Path) -> None:
    path = tmp_path / "full.mcap"
    env = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    done = subprocess.run(
        [sys.executable, "-c", FULL, str(path)],
        env=env,
        capture_output=True,
        text=True,
        timeout=30,
        check=True,
    )
    assert done.stdout.strip() == "File too large"
    payloads = [m.payload for m in recording.read(path)]
    assert len(payloads) > 1500
    assert [int(p.split()[0]) for p in payloads] == list(range(len(payloads)))
    assert recording.recover(path).recovered
    assert [m.payload for m in recording.read(path)] == payloads
