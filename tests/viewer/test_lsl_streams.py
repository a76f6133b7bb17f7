"""LSL streams before any of them is opened: channels, rows, time."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from brachium_body.angles import COLUMNS
from brachium_body.segments import SIDES
from brachium_viewer.lsl import streams
from brachium_viewer.lsl.lsl_clock import LslClock, compare
from brachium_wire.messages import Event, Info, SegmentPose, Skeleton
from brachium_wire.samples import read_samples, write_samples

NOW = 1_790_000_000_000_000_000


def skeleton(side="right", **more) -> Skeleton:
    end = "_r" if side == "right" else "_l"
    return Skeleton(
        **{
            "time_ns": NOW,
            "side": side,
            "origin": "worn",
            "forward": "none",
            "trunk_from_world": (1.0, 0.0, 0.0, 0.0),
            "segments": {
                f"upper_arm{end}": SegmentPose(quality="good", world_from_segment=(0.5, 0.5, 0.5, 0.5)),
                f"forearm{end}": SegmentPose(quality="missing"),
            },
            "positions": {"elbow": (0.1, 0.2, -0.3)},
            "angles": {"elbow_flexion": math.pi / 2, "wrist_flexion": 0.1},
            "assumed": {"wrist_flexion": "assumed"},
        }
        | more
    )


def by_label(stream: streams.Stream, rows: np.ndarray) -> dict[str, list[float]]:
    assert rows.shape[1] == len(stream.channels)
    labels = [channel.label for channel in stream.channels]
    assert len(set(labels)) == len(labels)
    return {label: rows[:, i].tolist() for i, label in enumerate(labels)}


@pytest.mark.parametrize("side", SIDES)
def test_a_skeletons_numbers_stand_under_their_labels_and_nothing_else_has_a_number(side):
    end = "_r" if side == "right" else "_l"
    stream = streams.skeleton_stream("lab", "p01", side, "worn", 50.0)
    row = by_label(stream, streams.skeleton_row(skeleton(side)))
    assert [row[f"elbow_{i}"][0] for i in "xyz"] == pytest.approx([0.1, 0.2, -0.3])
    assert [row[f"upper_arm{end}_q{i}"][0] for i in "wxyz"] == [0.5, 0.5, 0.5, 0.5]
    assert [row[f"trunk_from_world_q{i}"][0] for i in "wxyz"] == [1.0, 0.0, 0.0, 0.0]
    assert row[f"quality_upper_arm{end}"] == [streams.QUALITIES.index("good")]
    assert row[f"quality_hand{end}"] == row["quality_sternum"] == [streams.QUALITIES.index("missing")]
    numbers = {label for label, values in row.items() if not math.isnan(values[0])}
    assert len(numbers) == 3 + 4 + 4 + 4  # elbow, upper arm, trunk, and four qualities
    assert stream.content == "MoCap"
    types = {c.label: (c.type, c.unit) for c in stream.channels}
    assert types["elbow_y"] == ("PositionY", "meters")
    assert types[f"hand{end}_qw"] == ("OrientationA", "quaternion")
    assert stream.description["missing_values"] == "NaN: not measured"


def test_angles_are_in_degrees_with_the_quality_of_each_joints():
    stream = streams.angle_stream("lab", "p01", "right", "worn", 50.0)
    row = by_label(stream, streams.angle_row(skeleton()))
    assert row["elbow_flexion"] == [90.0]
    assert math.isnan(row["shoulder_flexion"][0])
    assert row["quality_elbow_angles"] == [streams.QUALITIES.index("good")]
    assert row["quality_wrist_angles"] == [streams.QUALITIES.index("assumed")]
    assert row["quality_shoulder_angles"] == [streams.QUALITIES.index("missing")]
    assert [c.label for c in stream.channels[: len(COLUMNS)]] == list(COLUMNS)


@pytest.mark.parametrize(
    ("origin", "name"), [("worn", "p01 right angles"), ("emulated", "p01 right angles (emulated)")]
)
def test_what_nobody_wears_says_so_in_its_name(origin, name):
    stream = streams.angle_stream("lab", "p01", "right", origin, 50.0)
    assert (stream.name, stream.description["origin"]) == (name, origin)
    assert stream.source_id.startswith(streams.OWN)
    assert "not a medical device" in stream.description["notice"]


def info(**more) -> Info:
    return Info(**{"node": "n", "rate_hz": 100.0, "origin": "worn", "host": "gw", "chip": "MPU-9150"} | more)


def batch(n: int, **blocks):
    return read_samples(
        write_samples(
            sequence=0,
            time_ns=[NOW + 10_000_000 * i for i in range(n)],
            device_us=range(n),
            received_ns=NOW,
            uncertainty_ns=0,
            **blocks,
        )
    )


def test_samples_without_a_magnetic_field_are_nan_there():
    said = info(magnetometer=True)
    stream = streams.sample_stream("lab", "p01", "hand_r", said)
    samples = batch(3, acc=np.ones((3, 3)), gyr=np.full((3, 3), 2.0), mag=[[30.0, 0.0, 1.0]], mag_index=[1])
    row = by_label(stream, streams.sample_rows(samples, said))
    assert row["acc_z"] == [1.0, 1.0, 1.0]
    assert row["gyr_x"] == [2.0, 2.0, 2.0]
    assert row["mag_x"] == [pytest.approx(math.nan, nan_ok=True), 30.0, pytest.approx(math.nan, nan_ok=True)]
    assert [(c.type, c.unit) for c in stream.channels[::3]] == [
        ("ACCEL", "m/s^2"), ("GYRO", "rad/s"), ("MAGN", "uT")
    ]  # fmt: skip
    assert (stream.model, stream.rate_hz) == ("MPU-9150", 100.0)
    none = by_label(stream, streams.sample_rows(batch(2, acc=np.ones((2, 3)), gyr=np.ones((2, 3))), said))
    assert np.isnan(none["mag_x"]).all()


def test_a_sensor_of_orientations_has_a_quaternion_and_nothing_else():
    said = info(orientation_only=True)
    stream = streams.sample_stream("lab", "p01", "hand_r", said)
    rows = streams.sample_rows(batch(2, quat=[[1.0, 0, 0, 0], [0, 1.0, 0, 0]]), said)
    assert by_label(stream, rows)["world_from_sensor_qx"] == [0.0, 1.0]
    assert len(stream.channels) == 4
    raw = batch(2, acc=np.ones((2, 3)), gyr=np.ones((2, 3)))
    assert np.isnan(streams.sample_rows(raw, said)).all()


def test_the_same_thing_is_the_same_stream_and_another_sensor_is_another():
    assert streams.sample_stream("lab", "p01", "hand_r", info()) is streams.sample_stream(
        "lab", "p01", "hand_r", info()
    )
    assert streams.sample_stream("lab", "p01", "hand_r", info(chip="BNO085")) != streams.sample_stream(
        "lab", "p01", "hand_r", info()
    )


def test_an_events_words_are_its_marker():
    assert streams.event_text(Event(time_ns=1, kind="note", text="begin")) == "note: begin"
    assert streams.event_text(Event(time_ns=1, kind="repetition")) == "repetition"


@given(st.integers(0, 2**62), st.floats(0.0, 1e7), st.integers(-(10**15), 10**15), st.integers(0, 10**6))
def test_lsl_time_and_host_time_are_there_and_back_to_a_microsecond(host_ns, lsl_s, later_ns, uncertainty):
    clock = LslClock(host_ns, lsl_s, uncertainty)
    assert abs(clock.host(clock.lsl(host_ns + later_ns)) - (host_ns + later_ns)) <= 1000
    assert clock.agrees(clock)
    assert not clock.agrees(LslClock(host_ns + 3_600_000_000_000, lsl_s, 0))


def test_the_quickest_look_at_both_clocks_counts():
    # host, LSL, host: the second look took 2 ns, the others were interrupted
    hosts = iter([100, 900, 1000, 1002, 2000, 2500])
    lsls = iter([1.0, 2.0, 3.0])
    assert compare(lambda: next(hosts), lambda: next(lsls), 7, rounds=3) == LslClock(1001, 2.0, 8)
