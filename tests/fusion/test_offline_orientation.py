"""Whole recordings: what an ideal and a spoilt magnetometer lead to, and the authors' filter beside it."""

import os
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import butter, sosfiltfilt
from scipy.spatial.transform import Rotation
from vqf import offlineVQF

from brachium_fusion.offline_orientation import smooth_orientation
from brachium_wire import table

DATA = Path(os.environ.get("BRACHIUM_DATA", Path(__file__).parents[3] / "shared" / "data"))
RATE = 100.0
FIELD = np.array([0.0, 19.0, -44.0])
"""Magnetic north and down, uT."""
UP = np.array([0.0, 0.0, 9.81])


def turning(seed: int, seconds: float, still_s: float = 5.0, rad_s: float = 1.5):
    """Return (truth, gyr, acc, field): a sensor that rests, then turns about all axes without translation."""
    random = np.random.default_rng(seed)
    n, rest = int(seconds * RATE), int(still_s * RATE)
    low = butter(2, 0.5, fs=RATE, output="sos")
    gyr = sosfiltfilt(low, random.normal(0.0, 1.0, (n, 3)), axis=0)
    gyr *= rad_s / gyr.std()
    gyr *= np.clip((np.arange(n) - rest) / RATE, 0.0, 1.0)[:, None]
    gyr = np.ascontiguousarray(gyr)
    quats = Rotation.from_rotvec(gyr / RATE).as_quat()
    quats[0] = Rotation.from_euler("ZXY", random.uniform(-40, 40, 3), degrees=True).as_quat()
    reach = 1
    while reach < n:  # products of all steps up to each, twice as far each time
        quats[reach:] = (Rotation.from_quat(quats[:-reach]) * Rotation.from_quat(quats[reach:])).as_quat()
        reach *= 2
    truths = Rotation.from_quat(quats)
    inverse = truths.inv()
    return truths, gyr, np.ascontiguousarray(inverse.apply(UP)), np.ascontiguousarray(inverse.apply(FIELD))


def errors_deg(quats, truth: Rotation):
    return np.degrees((Rotation.from_quat(np.roll(quats, -1, axis=-1)) * truth.inv()).magnitude())


def rms(errors) -> float:
    return float(np.sqrt(np.mean(np.square(errors))))


def theirs(gyr, acc, mag):
    return offlineVQF(gyr, acc, np.ascontiguousarray(mag), 1.0 / RATE)["quat9D"]


def test_ideal_sensors_give_the_truth() -> None:
    truth, gyr, acc, mag = turning(1, 60.0)
    found = smooth_orientation(gyr, acc, mag, RATE)
    assert errors_deg(found.world_from_sensor, truth).max() < 0.1
    assert not found.disturbed.any()
    assert np.abs(found.gyro_bias).max() < 1e-3


def test_without_magnetometer_it_is_the_authors_filter() -> None:
    _, gyr, acc, mag = turning(2, 20.0)
    wanted = offlineVQF(gyr, acc, None, 1.0 / RATE)
    for nothing in (None, np.full_like(mag, np.nan)):
        found = smooth_orientation(gyr, acc, nothing, RATE)
        assert np.array_equal(found.world_from_sensor, wanted["quat6D"])
        assert np.array_equal(found.gyro_bias, wanted["bias"])
        assert not found.disturbed.any()


def lag(mag, seconds: float):
    return np.roll(mag, round(seconds * RATE), axis=0)


SPOILT = {
    "a clasp of iron on the sensor": lambda mag, _: mag + np.array([9.0, -10.0, 6.0]),
    "a magnet on the sensor": lambda mag, _: mag + np.array([30.0, -25.0, 20.0]),
    "axes two degrees off": lambda mag, _: Rotation.from_rotvec([0.02, -0.03, 0.02]).apply(mag),
    "twenty milliseconds late": lambda mag, _: lag(mag, 0.02),
    "noise, and a little iron": lambda mag, rng: (
        mag + np.array([1.0, -1.0, 1.5]) + rng.normal(0.0, 1.0, mag.shape)
    ),
}


@pytest.mark.parametrize("what", SPOILT)
def test_what_is_wrong_with_a_magnetometer_is_found_from_the_movement(what: str) -> None:
    truth, gyr, acc, mag = turning(3, 90.0, rad_s=2.5)
    spoilt = SPOILT[what](mag, np.random.default_rng(4))
    ours = rms(errors_deg(smooth_orientation(gyr, acc, spoilt, RATE).world_from_sensor, truth))
    assert ours < 0.8
    assert ours < rms(errors_deg(theirs(gyr, acc, spoilt), truth))


def test_a_magnet_in_passing_does_not_turn_the_heading_and_is_told() -> None:
    truth, gyr, acc, mag = turning(5, 90.0)
    near = slice(3000, 4500)
    world = np.zeros_like(mag)
    world[near] = np.array([25.0, -20.0, 10.0])
    mag = mag + truth.inv().apply(world)
    found = smooth_orientation(gyr, acc, mag, RATE)
    assert errors_deg(found.world_from_sensor, truth).max() < 1.5
    assert found.disturbed[3100:4400].all()
    assert not found.disturbed[:2900].any()
    assert not found.disturbed[4600:].any()


def test_a_heading_that_drifts_is_brought_back_to_north() -> None:
    """A vertical bias that no rest shows: it begins when the movement does."""
    truth, gyr, acc, mag = turning(6, 120.0)
    vertical = truth.inv().apply([0.0, 0.0, 1.0])
    moving = (np.arange(len(gyr)) > 600)[:, None]
    found = smooth_orientation(gyr + np.radians(0.1) * vertical * moving, acc, mag, RATE)
    assert errors_deg(found.world_from_sensor, truth).max() < 1.0  # 11.4 deg by the end if it were not


def test_a_slow_magnetometer_is_enough() -> None:
    truth, gyr, acc, mag = turning(7, 60.0)
    few = np.full_like(mag, np.nan)
    few[3::7] = mag[3::7]
    assert errors_deg(smooth_orientation(gyr, acc, few, RATE).world_from_sensor, truth).max() < 0.3


def test_after_a_gap_the_heading_is_found_anew_and_the_gap_stays_one() -> None:
    truth, gyr, acc, mag = turning(8, 90.0)
    for block in (gyr, acc, mag):
        block[4000:4300] = np.nan
        block[7000:7005] = np.nan
        block[7007:7020] = np.nan
    found = smooth_orientation(gyr, acc, mag, RATE)
    missing = np.isnan(found.world_from_sensor).any(axis=1)
    assert np.array_equal(missing, np.isnan(gyr).any(axis=1))
    assert not found.disturbed[missing].any()
    errors = np.where(
        missing, 0.0, errors_deg(np.where(missing[:, None], [1.0, 0, 0, 0], found.world_from_sensor), truth)
    )
    assert errors[:7000].max() < 0.5
    assert errors[7020:].max() < 0.5


def test_bursts_of_loss_cost_little_and_stay_gaps() -> None:
    truth, gyr, acc, mag = turning(6, 60.0)
    gone = np.zeros(len(gyr), dtype=bool)
    for start in range(900, 5900, 130):
        gone[start : start + 25] = True
    lossy = [np.where(gone[:, None], np.nan, block) for block in (gyr, acc, mag)]
    found = smooth_orientation(*lossy, RATE)
    assert np.isnan(found.world_from_sensor[gone]).all()
    assert not found.disturbed[gone].any()
    assert rms(errors_deg(found.world_from_sensor[~gone], truth[~gone])) < 2.0
    assert np.isnan(gyr).sum() == 0  # what was given stays as it was


def test_the_unit_of_the_field_does_not_matter() -> None:
    _, gyr, acc, mag = turning(9, 40.0)
    mag = mag + np.array([4.0, 1.0, -2.0])
    in_ut = smooth_orientation(gyr, acc, mag, RATE).world_from_sensor
    in_gauss = smooth_orientation(gyr, acc, 0.01 * mag, RATE).world_from_sensor
    assert np.allclose(in_ut, in_gauss, atol=1e-6)


@pytest.mark.data
def test_real_recordings_come_out_better_than_by_the_authors_filter() -> None:
    names = [path.name for path in sorted(DATA.glob("broad_*"))] if DATA.is_dir() else []
    if len(names) < 4:
        pytest.skip(f"no broad_* recordings in {DATA}; set BRACHIUM_DATA to the folder that holds them")
    ours, vqf = [], []
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
        rate = 285.714286
        ours.append(
            rms(errors_deg(smooth_orientation(gyr, acc, mag, rate).world_from_sensor[scored], optical))
        )
        vqf.append(rms(errors_deg(offlineVQF(gyr, acc, mag, 1.0 / rate)["quat9D"][scored], optical)))
    assert np.mean(ours) < 0.7 * np.mean(vqf)
    assert sum(a < 1.2 * b for a, b in zip(ours, vqf, strict=True)) == len(names)
