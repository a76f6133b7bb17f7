"""A recording as a loss of power leaves it: whole up to some byte, and then zeros, anything, or nothing."""

import random
from pathlib import Path
from typing import NamedTuple

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mcap.reader import make_reader

from brachium_wire import keys, recording

SECOND = 1_000_000_000
STEP_NS = 20_000_000
KEYS = [keys.imu("gym", "p01", "forearm_r"), keys.skeleton("gym", "p01", "right")]


class Whole(NamedTuple):
    """A recording, its messages, and where each of its blocks ends."""

    data: bytes
    messages: list[recording.Recorded]
    blocks: list[tuple[int, int]]
    """First byte after the block, number of messages up to it."""


@pytest.fixture(scope="session")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Whole:
    path = tmp_path_factory.mktemp("tails") / "whole.mcap"
    messages = []
    with recording.RecordingWriter(path, {"room": "gym"}) as writer:
        for i in range(300):
            one = recording.Recorded(KEYS[i % 2], b"payload %d " % i * 10, SECOND + i * STEP_NS)
            writer.write(*one)
            messages.append(one)
    with path.open("rb") as file:
        summary = make_reader(file).get_summary()
    assert summary is not None
    blocks, count = [], 0
    for index in summary.chunk_indexes:
        count = sum(m.log_time_ns <= index.message_end_time for m in messages)
        blocks.append((index.chunk_start_offset + index.chunk_length, count))
    assert count == 300
    assert len(blocks) >= 25  # one each 0.2 s
    return Whole(path.read_bytes(), messages, blocks)


TAILS = ("zeros", "random", "nothing")


@given(
    part=st.floats(0.0, 1.0, exclude_max=True),
    kind=st.sampled_from(TAILS),
    length=st.one_of(st.integers(1, 64), st.integers(1, 20_000)),
    seed=st.integers(0, 1 << 32),
)
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=60, deadline=None)
def test_every_block_before_the_tail_is_recovered_and_nothing_else(
    whole: Whole, tmp_path: Path, part: float, kind: str, length: int, seed: int
) -> None:
    first = whole.blocks[0][0]
    cut = first + int(part * (len(whole.data) - first))
    tail = {"zeros": bytes(length), "random": random.Random(seed).randbytes(length), "nothing": b""}[kind]
    path = tmp_path / "hurt.mcap"
    path.write_bytes(whole.data[:cut] + tail)
    least = max(count for end, count in whole.blocks if end <= cut)
    report = recording.recover(path)
    assert report.recovered
    reading = recording.read(path)
    assert reading.metadata["recovered"] == "true"
    found = list(reading)
    assert reading.closed
    assert len(found) >= least
    assert found == whole.messages[: len(found)]
    assert len(found) <= least + recording.FLUSH_NS // STEP_NS  # a block that the tail happens to complete
    with path.open("rb") as file:
        judged = [(c.topic, m.data) for _, c, m in make_reader(file, validate_crcs=True).iter_messages()]
    assert judged == [(m.key, m.payload) for m in found]


def test_a_recovery_without_room_leaves_the_file_as_it_was(
    whole: Whole, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "open.mcap"
    path.write_bytes(whole.data[: len(whole.data) // 2])

    def full(writer: recording.RecordingWriter, key: str, payload: bytes, time_ns: int) -> None:
        del writer, key, payload, time_ns
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as small:
        small.setattr(recording.RecordingWriter, "write", full)
        with pytest.raises(OSError, match="No space left"):
            recording.recover(path)
    assert path.read_bytes() == whole.data[: len(whole.data) // 2]
    assert [p.name for p in tmp_path.iterdir()] == ["open.mcap"]
    assert recording.recover(path).recovered
