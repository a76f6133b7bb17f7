"""Three taps on an emulated sensor: found where they were, and nowhere else."""

import os
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import butter, sosfilt

from brachium_nodes.exercises import EXERCISES
from brachium_nodes.session import session_arrays
from brachium_nodes.wearer import WearerSettings
from brachium_viewer.lsl.tap_report import taps_in
from brachium_viewer.lsl.taps import TapWatch, triple_taps
from brachium_wire import keys, recording
from brachium_wire.codec import encode
from brachium_wire.samples import write_samples

DATA = Path(os.environ.get("BRACHIUM_DATA", Path(__file__).parents[3] / "shared" / "data"))
START = 1_790_000_000_000_000_000
FINE_HZ = 4000.0
CUTOFF_HZ = {50.0: 20.0, 100.0: 44.0, 200.0: 92.0}
"""Of a sensor that samples at a rate: below half of it, or jolts would fall between samples."""


def tapped(taps_s, rate_hz=100.0, seconds=5.0, peak=200.0, seed=0):
    """Return times and raw acceleration of a resting sensor that is tapped at these times.

    A tap is half a sine of 6 ms; the sensor's own filter is a low-pass of second order at its cut-off.
    """
    random = np.random.default_rng(seed)
    fine = np.zeros(int(seconds * FINE_HZ))
    shape = peak * np.sin(np.pi * np.arange(0.0, 1.0, 1.0 / (0.006 * FINE_HZ)))
    for at in taps_s:
        begin = int(at * FINE_HZ)
        fine[begin : begin + len(shape)] += shape * random.uniform(0.8, 1.2)
    seen = sosfilt(butter(2, CUTOFF_HZ[rate_hz], fs=FINE_HZ, output="sos"), fine)
    phase = int(random.uniform(0.0, FINE_HZ / rate_hz))
    index = np.arange(phase, len(fine), int(FINE_HZ / rate_hz))
    along = np.array([0.3, -0.5, 0.8]) / np.linalg.norm([0.3, -0.5, 0.8])
    acc = np.array([0.0, 9.81, 0.0]) + seen[index, None] * along + random.normal(0.0, 0.05, (len(index), 3))
    return START + np.rint(index / FINE_HZ * 1e9).astype(np.int64), acc


@given(
    st.floats(0.9, 1.5),
    st.floats(0.25, 0.45),
    st.floats(0.7, 1.4),
    st.sampled_from([50.0, 100.0, 200.0]),
    st.integers(0, 999),
)
@settings(max_examples=30)
def test_taps_are_found_within_a_sample_and_a_half(first, pause, second, rate_hz, seed):
    taps = [first, first + pause, first + pause + pause * second]
    times, acc = tapped(taps, rate_hz, seed=seed)
    (found,) = triple_taps(times, acc)
    off_s = (np.array(found.times_ns) - START) * 1e-9 - taps
    # the jolt's middle is 3 ms after its begin; the filter adds about a third of its period
    assert np.all(np.abs(off_s - 0.003 - 0.3 / CUTOFF_HZ[rate_hz]) < 1.5 / rate_hz)


@pytest.mark.parametrize(
    ("taps", "why"),
    [
        ([1.0, 1.3], "two are not three"),
        ([1.0], "one is not three"),
        ([1.0, 1.3, 2.4], "the last came too late"),
        ([1.0, 1.08, 1.16], "too fast for a hand"),
        ([1.0, 1.2, 1.75], "uneven"),
        ([1.0, 1.3, 1.6, 1.9], "four"),
        ([0.2, 0.5, 0.8], "no rest before them was seen"),
        ([4.0, 4.3, 4.6], "no rest after them was seen"),
    ],
)
def test_what_is_no_triple_is_not_taken_for_one(taps, why):
    assert triple_taps(*tapped(taps)) == [], why


def test_taps_of_which_samples_are_missing_are_not_taken():
    times, acc = tapped([1.0, 1.3, 1.6])
    keep = np.abs((times - START) * 1e-9 - 1.45) > 0.05
    assert len(triple_taps(times, acc)) == 1
    assert triple_taps(times[keep], acc[keep]) == []


@pytest.mark.parametrize("n", [0, 1, 2, 5])
def test_hardly_any_samples_hold_none(n):
    times, acc = tapped([1.0, 1.3, 1.6])
    assert triple_taps(times[:n], acc[:n]) == []


@pytest.mark.parametrize("exercise", sorted(EXERCISES))
def test_no_exercise_of_the_emulated_wearer_looks_like_taps(exercise):
    made = WearerSettings(exercise=exercise, level="typical", seed=5, rate_hz=100.0)
    session = session_arrays(made, 40.0, raw=("acc",))
    times = START + np.rint(session.time_s * 1e9).astype(np.int64)
    assert {s: triple_taps(times, sensor.acc) for s, sensor in session.sensors.items()} == {
        s: [] for s in session.sensors
    }


@given(st.integers(1, 30), st.integers(0, 99))
@settings(max_examples=20)
def test_as_they_come_taps_are_told_once_whatever_the_batches(size, seed):
    times, acc = tapped([1.0, 1.3, 1.6, 4.0, 4.4, 4.8], seconds=7.0, seed=seed)
    watch, told = TapWatch(), []
    for first in range(0, len(times), size):
        told += watch.feed(times[first : first + size].tolist(), acc[first : first + size])
    assert told == triple_taps(times, acc)
    assert len(told) == 2


def write(path, subject, segment, times, acc):
    with recording.RecordingWriter(path) as writer:
        for first in range(0, len(times), 5):
            part = slice(first, first + 5)
            batch = write_samples(
                sequence=first,
                time_ns=times[part],
                device_us=(times[part] - START) // 1000,
                received_ns=int(times[part][-1]),
                uncertainty_ns=0,
                acc=acc[part],
                gyr=np.zeros((len(acc[part]), 3)),
            )
            writer.write(keys.imu("lab", subject, segment), encode(batch), batch.received_ns)
        writer.write(keys.imu("lab", subject, segment), b"\xc1", int(times[-1]))


def test_a_capture_folders_taps_are_found_too(tmp_path):
    times, acc = tapped([2.0, 2.3, 2.6])
    rows = ["t,ax,ay,az,gx,gy,gz"]
    rows += [
        ",".join(map(repr, [100.0 + float(t - START) * 1e-9, *a.tolist(), 0.0, 0.0, 0.0]))
        for t, a in zip(times, acc, strict=True)
    ]
    (tmp_path / "forearm_r.csv").write_text("\n".join(rows) + "\n")
    (found,) = taps_in(tmp_path, camera_s=5.0)
    assert (found.subject, found.segment) == ("capture", "forearm_r")
    assert found.first_s == pytest.approx(2.0, abs=0.03)
    assert found.camera_lag_s == pytest.approx(5.0 - found.first_s)


@pytest.mark.data
def test_real_recordings_hold_jolts_but_no_three_taps():
    """Among them a person who walks, and a sensor that is tapped again and again while it is moved."""
    folders = [folder for folder in DATA.glob("*") if (folder / "capture.toml").is_file()]
    if not folders:
        pytest.skip(f"no recordings in {DATA}; set BRACHIUM_DATA to the folder that holds them")
    assert {folder.name: taps_in(folder) for folder in folders} == {folder.name: [] for folder in folders}


def test_a_recordings_taps_give_the_cameras_lag(tmp_path):
    times, acc = tapped([2.0, 2.3, 2.6])
    write(tmp_path / "a.mcap", "p01", "forearm_r", times, acc)
    (found,) = taps_in(tmp_path / "a.mcap", camera_s=12.5)
    assert (found.subject, found.segment) == ("p01", "forearm_r")
    assert found.first_s == pytest.approx((found.times_ns[0] - times[0]) * 1e-9)
    assert found.camera_lag_s == pytest.approx(12.5 - found.first_s)
    assert found.first_s == pytest.approx(2.0, abs=0.03)
    (unknown,) = taps_in(tmp_path / "a.mcap")
    assert unknown.camera_lag_s is None
