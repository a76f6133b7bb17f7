"""The default live filter: what it makes of ideal and of spoilt magnetometers, and in whatever batches."""

import os
from pathlib import Path

import msgpack
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import butter, sosfiltfilt
from scipy.spatial.transform import Rotation
from vqf import VQF

from brachium_fusion.auto_filter import AutoFilter
from brachium_wire import table

DATA = Path(os.environ.get("BRACHIUM_DATA", Path(__file__).parents[3] / "shared" / "data"))
RATE = 100.0
FIELD = np.array([0.0, 19.0, -44.0])
"""Magnetic north and down, uT."""
UP = np.array([0.0, 0.0, 9.81])


def turning(seed: int, seconds: float, still_s: float = 5.0, rad_s: float = 1.5):
    """Return (truth, gyr, acc, field): a sensor that rests, then turns about all axes without translation."""
    random = np.random.default_rng(seed)
    n = int(seconds * RATE)
    low = butter(2, 0.5, fs=RATE, output="sos")
    gyr = sosfiltfilt(low, random.normal(0.0, 1.0, (n, 3)), axis=0)
    gyr *= rad_s / gyr.std()
    gyr = np.ascontiguousarray(gyr * np.clip(np.arange(n) / RATE - still_s, 0.0, 1.0)[:, None])
    quats = Rotation.from_rotvec(gyr / RATE).as_quat()
    quats[0] = Rotation.from_euler("ZXY", random.uniform(-40, 40, 3), degrees=True).as_quat()
    reach = 1
    while reach < n:  # products of all steps up to each, twice as far each time
        quats[reach:] = (Rotation.from_quat(quats[:-reach]) * Rotation.from_quat(quats[reach:])).as_quat()
        reach *= 2
    truth = Rotation.from_quat(quats)
    return truth, gyr, np.ascontiguousarray(truth.inv().apply(UP)), truth.inv().apply(FIELD)


def errors_deg(quats, truth: Rotation):
    return np.degrees((Rotation.from_quat(np.roll(quats, -1, axis=-1)) * truth.inv()).magnitude())


def rms(errors) -> float:
    return float(np.sqrt(np.mean(np.square(errors))))


def vqf(gyr, acc, mag):
    return VQF(1.0 / RATE).updateBatch(gyr, acc, np.ascontiguousarray(mag))["quat9D"]


def test_ideal_sensors_give_the_truth() -> None:
    truth, gyr, acc, mag = turning(1, 60.0)
    auto = AutoFilter(1.0 / RATE, True)
    assert errors_deg(auto.update(gyr, acc, mag, None), truth).max() < 0.1
    assert not auto.disturbed


def test_the_first_sample_has_its_heading() -> None:
    truth, gyr, acc, mag = turning(2, 1.0)
    assert (
        errors_deg(AutoFilter(1.0 / RATE, True).update(gyr[:1], acc[:1], mag[:1], None), truth[:1]).max()
        < 0.1
    )


@pytest.fixture(scope="module")
def spoilt():
    _, gyr, acc, mag = turning(3, 20.0, still_s=1.0)
    random = np.random.default_rng(3)
    return gyr, acc, mag + random.normal(0.0, 2.0, mag.shape) + np.array([3.0, -2.0, 1.0])


@given(
    cuts=st.lists(st.sampled_from([1, 2, 5, 17, 50, 51, 200]), min_size=2, max_size=30),
    every=st.sampled_from([1, 3]),
)
@settings(max_examples=20, deadline=None)
def test_batches_of_any_size_give_the_same(spoilt, cuts: list[int], every: int) -> None:
    gyr, acc, mag = (block[: sum(cuts)] for block in spoilt)
    index = tuple(range(0, len(gyr), every))
    wanted = AutoFilter(1.0 / RATE, True).update(
        gyr, acc, mag if every == 1 else mag[list(index)], None if every == 1 else index
    )
    auto = AutoFilter(1.0 / RATE, True)
    got, at = [], 0
    for n in (min(cut, len(gyr) - sum(cuts[:i])) for i, cut in enumerate(cuts)):
        here = tuple(i - at for i in index if at <= i < at + n)
        rows = mag[[at + i for i in here]]
        if every == 1:
            got.append(auto.update(gyr[at : at + n], acc[at : at + n], rows, None))
        else:
            got.append(auto.update(gyr[at : at + n], acc[at : at + n], rows if here else None, here or None))
        at += n
    assert np.array_equal(np.concatenate(got), wanted)


@given(cut=st.integers(0, 2000))
@settings(max_examples=25, deadline=None)
def test_a_filter_put_back_goes_on_as_if_it_had_never_stopped(spoilt, cut: int) -> None:
    gyr, acc, mag = spoilt
    whole, first, second = (AutoFilter(1.0 / RATE, True) for _ in range(3))
    wanted = whole.update(gyr, acc, mag, None)
    if cut:
        first.update(gyr[:cut], acc[:cut], mag[:cut], None)
    second.restore(msgpack.unpackb(msgpack.packb(first.state())))
    if cut < len(gyr):
        assert np.array_equal(second.update(gyr[cut:], acc[cut:], mag[cut:], None), wanted[cut:])
    assert msgpack.packb(second.state()) == msgpack.packb(whole.state())  # it may hold NaN


def test_a_slow_magnetometer_is_enough() -> None:
    truth, gyr, acc, mag = turning(4, 60.0)
    index = tuple(range(3, len(gyr), 7))
    quats = AutoFilter(1.0 / RATE, True).update(gyr, acc, mag[list(index)], index)
    assert errors_deg(quats, truth)[3:].max() < 0.3


def test_stretches_without_a_field_are_bridged_by_the_gyroscope() -> None:
    truth, gyr, acc, mag = turning(5, 60.0)
    auto = AutoFilter(1.0 / RATE, True)
    quats = [
        auto.update(gyr[s], acc[s], mag[s] if s.start % 2000 < 1000 else None, None)
        for s in (slice(at, at + 25) for at in range(0, len(gyr), 25))
    ]
    assert errors_deg(np.concatenate(quats), truth).max() < 0.3


def test_a_magnet_in_passing_is_told_and_turns_the_heading_less_than_it_does_vqfs() -> None:
    truth, gyr, acc, mag = turning(6, 90.0)
    near = slice(4000, 5500)
    world = np.zeros_like(mag)
    world[near] = np.array([18.0, -12.0, 5.0])
    mag = mag + truth.inv().apply(world)
    auto = AutoFilter(1.0 / RATE, True)
    quats, told = [], []
    for at in range(0, len(gyr), 10):
        part = slice(at, at + 10)
        quats.append(auto.update(gyr[part], acc[part], mag[part], None))
        told += [auto.disturbed] * 10
    ours = errors_deg(np.concatenate(quats), truth)
    assert ours.max() < 5.0
    assert rms(ours) < rms(errors_deg(vqf(gyr, acc, mag), truth))
    assert all(told[4100:5450])
    assert not any(told[:3990])
    assert not any(told[5700:])


def test_a_field_that_stays_another_one_is_learnt_again() -> None:
    """The wearer went to another room: the field is 12 uT stronger, the heading was not lost on the way."""
    truth, gyr, acc, mag = turning(7, 400.0)
    mag[6000:] += truth[6000:].inv().apply([0.0, 4.5, -11.0])
    auto = AutoFilter(1.0 / RATE, True)
    quats = auto.update(gyr[:7000], acc[:7000], mag[:7000], None)
    assert auto.disturbed
    later = auto.update(gyr[7000:], acc[7000:], mag[7000:], None)
    assert not auto.disturbed
    assert max(errors_deg(quats, truth[:7000]).max(), errors_deg(later, truth[7000:]).max()) < 3.0


def test_a_late_magnetometer_is_found_out() -> None:
    """30 ms at 150 deg/s are 4 deg of heading; turning about one axis they would all be to one side."""
    truth, gyr, acc, mag = turning(8, 90.0, rad_s=2.5)
    late = np.concatenate([mag[:3], mag[:-3]])
    ours = errors_deg(AutoFilter(1.0 / RATE, True).update(gyr, acc, late, None), truth)
    assert rms(ours[2000:]) < 0.3
    assert rms(ours[2000:]) < rms(errors_deg(vqf(gyr, acc, late), truth)[2000:])


def test_begun_in_movement_it_finds_its_heading() -> None:
    truth, gyr, acc, mag = turning(9, 60.0, still_s=0.0, rad_s=2.0)
    swing = 3.0 * np.sin(np.arange(len(acc))[:, None] / RATE * [5.0, 7.0, 6.0])
    acc = acc + truth.inv().apply(swing)
    quats = AutoFilter(1.0 / RATE, True).update(gyr[200:], acc[200:], mag[200:], None)
    assert errors_deg(quats, truth[200:])[1000:].max() < 3.0


def test_a_magnet_on_the_sensor_is_found_from_the_movement() -> None:
    truth, gyr, acc, mag = turning(10, 120.0)
    mag = mag + np.array([9.0, -10.0, 6.0])
    ours = errors_deg(AutoFilter(1.0 / RATE, True).update(gyr, acc, mag, None), truth)
    theirs = errors_deg(vqf(gyr, acc, mag), truth)
    assert rms(ours[:500]) > 5.0  # nothing can tell before it moves
    assert rms(ours[6000:]) < 1.0
    assert rms(ours[6000:]) < 0.2 * rms(theirs[6000:])


def test_the_sway_of_a_stander_is_no_bias() -> None:
    """1 deg about 0.3 Hz, with a gyroscope as quiet as a good one: 0.005 (deg/s)/sqrt(Hz)."""
    random = np.random.default_rng(11)
    n = int(120.0 * RATE)
    narrow = butter(2, [0.15, 0.45], btype="band", fs=RATE, output="sos")
    angles = sosfiltfilt(narrow, random.normal(0.0, 1.0, (n, 3)), axis=0)
    angles *= np.radians(1.0) / angles.std(axis=0) * np.clip(np.arange(n) / RATE - 3.0, 0.0, 1.0)[:, None]
    truth = Rotation.from_rotvec(angles)
    gyr = np.vstack([np.zeros(3), (truth[:-1].inv() * truth[1:]).as_rotvec() * RATE])
    gyr += random.normal(0.0, np.radians(0.005) * np.sqrt(RATE / 2.0), (n, 3))
    acc = np.ascontiguousarray(truth.inv().apply(UP)) + random.normal(0.0, 0.03, (n, 3))
    ours = errors_deg(AutoFilter(1.0 / RATE, False).update(gyr, acc, None, None), truth)
    theirs = errors_deg(VQF(1.0 / RATE).updateBatch(gyr, acc)["quat6D"], truth)
    assert ours.max() < 0.5
    assert ours.max() < 0.3 * theirs.max()


@pytest.mark.data
def test_real_recordings_come_out_better_than_by_vqf() -> None:
    names = [path.name for path in sorted(DATA.glob("broad_*"))] if DATA.is_dir() else []
    if len(names) < 4:
        pytest.skip(f"no broad_* recordings in {DATA}; set BRACHIUM_DATA to the folder that holds them")
    ours, theirs = [], []
    for name in names:
        read = table.read(DATA / name / "forearm_r.parquet").columns
        gyr, acc, mag = (
            np.ascontiguousarray(
                np.stack([read[f"{kind}{axis}"] for axis in "xyz"], axis=1), dtype=np.float64
            )
            for kind in "gam"
        )
        truth = table.read(DATA / name / "truth.parquet").columns
        quats = np.stack([truth[f"forearm_r_sensor_q{p}"] for p in "wxyz"], axis=1).astype(np.float64)
        scored = truth["movement"].astype(bool) & np.isfinite(quats).all(axis=1)
        optical = Rotation.from_quat(np.roll(quats[scored], -1, axis=1))
        period = 1.0 / 285.714286
        ours.append(rms(errors_deg(AutoFilter(period, True).update(gyr, acc, mag, None)[scored], optical)))
        theirs.append(rms(errors_deg(VQF(period).updateBatch(gyr, acc, mag)["quat9D"][scored], optical)))
    assert np.mean(ours) < 0.95 * np.mean(theirs)
