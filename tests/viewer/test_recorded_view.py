"""A recording in the view, as Rerun's own reader finds it: who is there, when, and what the sensors sent."""

import threading
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

import msgspec
import numpy as np
import pytest

rr = pytest.importorskip("rerun", reason="needs the extra 'view'")

from brachium_viewer import recorded_view  # noqa: E402  after the check for the extra
from brachium_viewer.drawings import Layout, Signal, Trail  # noqa: E402
from brachium_viewer.live import ViewSettings  # noqa: E402
from brachium_viewer.recorded_view import RATE_HZ, moments  # noqa: E402
from brachium_viewer.screen import APPLICATION, Mailbox, Pen  # noqa: E402
from brachium_viewer.viewer_process import ViewError  # noqa: E402
from brachium_wire import keys, recording  # noqa: E402
from brachium_wire.codec import encode  # noqa: E402
from brachium_wire.messages import Skeleton  # noqa: E402
from brachium_wire.samples import write_samples  # noqa: E402

T = TypeVar("T")
NOW = 1_700_000_000_000_000_000
SECONDS = 6.0
LOST = range(200, 210)
"""Samples of the hand that were lost."""


def samples(first: int) -> bytes:
    """Return ten samples of 10 ms from the recording's start on; rates are the samples' numbers, deg/s."""
    rows = np.arange(first, first + 10)
    times = [NOW + int(n) * 10_000_000 for n in rows]
    rates = np.radians(np.column_stack([rows, -rows, 0 * rows]))
    return encode(
        write_samples(
            sequence=first, time_ns=times, device_us=[t // 1000 for t in times], received_ns=times[-1],
            uncertainty_ns=1000, acc=[[0.0, 9.8, 0.0]] * 10, gyr=rates,
        )
    )  # fmt: skip


@pytest.fixture
def path(tmp_path: Path, arm_at: Callable[..., Skeleton]) -> Path:
    """A recording of two subjects, one of them with both arms and a sensor's samples."""
    path = tmp_path / "two.mcap"
    with recording.RecordingWriter(path) as writer:
        for n in range(round(SECONDS * 50)):
            time_ns = NOW + n * 20_000_000
            for subject, side in (("p01", "right"), ("p01", "left"), ("p02", "right")):
                skeleton = msgspec.structs.replace(arm_at(n * 0.02, side=side), time_ns=time_ns)
                writer.write(keys.skeleton("gym", subject, side), encode(skeleton), time_ns)
            if n % 5 == 4 and (first := 2 * (n - 4)) not in LOST:
                writer.write(keys.imu("gym", "p01", "hand_r"), samples(first), time_ns)
            if n == 20:
                writer.write(keys.skeleton("gym", "p01", "right"), b"\xc1", time_ns)
    return path


def drawn(path: Path, **more: object) -> list[recorded_view.Moment]:
    with recording.read(path) as messages:
        return list(moments(messages, **more))  # type: ignore[arg-type]


def of(found: list[recorded_view.Moment], name: str, kind: type[T]) -> list[T]:
    """Return every drawing of one name."""
    out = []
    for _, drawings in found:
        drawing = drawings.get(name)
        if drawing is not None:
            assert isinstance(drawing, kind)
            out.append(drawing)
    return out


def times(found: list[recorded_view.Moment], name: str) -> list[float]:
    return [time_s for time_s, drawings in found if name in drawings]


def test_everybody_is_drawn_from_the_start_at_the_recordings_own_times(path: Path) -> None:
    found = drawn(path)
    for name in ("p01/right", "p01/left", "p02/right"):
        seen = times(found, f"world/{name}")
        assert seen == sorted(seen)
        assert abs(seen[0]) < 2.0 / RATE_HZ
        assert abs(seen[-1] - SECONDS) < 2.0 / RATE_HZ
        assert abs(len(seen) - SECONDS * RATE_HZ) <= 3
        assert max(np.diff(seen)) < 2.5 / RATE_HZ
    last = of(found, "layout", Layout)[-1]
    assert {(arm.subject, arm.side) for arm in last.arms} == {
        ("p01", "right"), ("p01", "left"), ("p02", "right"),
    }  # fmt: skip
    assert last.recorded
    assert last.raw == ()
    trails = of(found, "world/p01/left_trail", Trail)
    assert len(trails[-1].strips) >= 1


def test_any_time_and_one_subject_can_be_chosen(path: Path) -> None:
    found = drawn(path, at_s=3.0, subject="p02")
    seen = times(found, "world/p02/right")
    assert 3.0 - 1.5 / RATE_HZ <= seen[0] < 3.0 + 2.0 / RATE_HZ
    assert seen[-1] > SECONDS - 2.0 / RATE_HZ
    assert times(found, "world/p01/right") == []


def test_raw_signals_are_whole_and_broken_where_samples_were_lost(path: Path) -> None:
    found = drawn(path, raw=True)
    pieces = of(found, "raw/p01/hand_r/gyr", Signal)
    assert 2 <= len(pieces) <= 4  # some seconds each
    values = np.concatenate([piece.values for piece in pieces])
    at_s = np.concatenate([piece.times_s for piece in pieces])
    sent = np.array([n for n in range(600) if n not in LOST])
    there = np.isfinite(values).all(axis=1)
    np.testing.assert_allclose(values[there][:, 0], sent, atol=1e-3)
    np.testing.assert_allclose(values[there][:, 1], -sent, atol=1e-3)
    np.testing.assert_allclose(np.diff(at_s[there]), np.diff(sent) * 0.01, atol=1e-6)
    assert list(np.flatnonzero(~there)) == [LOST[0]]  # one break, between the two sides of the gap
    layout = of(found, "layout", Layout)[-1]
    assert layout.raw == (("p01", "hand_r"),)


def test_reruns_own_reader_finds_arms_trails_and_signals(path: Path, tmp_path: Path) -> None:
    from rerun.chunk import RrdReader

    file = tmp_path / "view.rrd"
    stream = rr.RecordingStream(APPLICATION, recording_id="r")
    stream.save(file)
    pen = Pen(stream)
    for time_s, drawings in drawn(path, raw=True):
        pen.write({name: (time_s, drawing) for name, drawing in drawings.items()})
    stream.disconnect()
    rows: dict[str, list[float]] = {}
    for chunk in RrdReader(file).stream():
        batch = chunk.to_record_batch()
        if "time" in batch.schema.names:
            seconds = np.array(batch.column("time").cast("int64").to_pylist(), dtype=float) * 1e-9
            rows.setdefault(str(chunk.entity_path), []).extend(seconds.tolist())
    for name in ("p01/right", "p01/left", "p02/right"):
        seen = rows[f"/world/{name}"]
        assert min(seen) < 0.1
        assert max(seen) > SECONDS - 0.1
        assert len(rows[f"/world/{name}_trail"]) > 50
    assert len(rows["/raw/p01/hand_r/gyr"]) == 591  # what came, and one break
    assert len(rows["/raw/p01/hand_r/acc"]) == 591
    assert "/angles/elbow_flexion/estimate/p02_right" in rows


def test_signals_that_wait_are_joined_and_everything_else_is_replaced() -> None:
    mailbox = Mailbox()
    for n in range(3):
        mailbox.put(float(n), {"raw": Signal(np.array([float(n)]), np.full((1, 3), n))})
    (waiting,) = (mailbox.take() or {}).values()
    assert isinstance(waiting[1], Signal)
    assert waiting[1].times_s.tolist() == [0.0, 1.0, 2.0]
    assert mailbox.replaced == 0


def test_a_time_after_the_end_is_said_before_anything_opens(
    path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(recorded_view, "opened", lambda *_: pytest.fail("a view was opened"))
    with pytest.raises(ViewError, match=r"no skeletons from 100 s on, it ends at \d+ s; choose another --at"):
        recorded_view.run(path, 100.0, ViewSettings(web=True), threading.Event())


def test_a_time_without_a_recording_is_usage() -> None:
    from brachium.__main__ import main

    assert main(["view", "--at", "3"]) == 2
