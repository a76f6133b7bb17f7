"""The estimate of two sensors on one joint from a whole recording: exact motion, gaps, real recordings."""

import os
from pathlib import Path

import numpy as np
import pytest
from vqf import VQF

from brachium_body import rotation
from brachium_fusion.joint_filter import JointFilter
from brachium_fusion.joint_model import Joint
from brachium_fusion.joint_smoother import smooth_joint

RATE = 50.0
DATA = Path(os.environ.get("BRACHIUM_DATA", Path(__file__).parents[3] / "shared" / "data"))
RECORDINGS = ("1D_02", "1D_03", "2D_01", "2D_03", "3D_01", "3D_03")
"""All six, whole: two of each number of axes."""
LIVE_DEG, BEST_DEG = 1.7, 1.52
"""Means of what is reached here, with a twentieth to spare; promised are 2.1 and 1.9."""


def smooth(motion, angle, joint=None, shared=False, rate=RATE):
    joint = joint or Joint(axes=motion.axes, lever_a=motion.lever_a, lever_b=motion.lever_b)
    b = rotation.multiply(rotation.about(2, angle), motion.world_from_b)
    sensors = (motion.gyr_a, motion.acc_a), (motion.gyr_b, motion.acc_b)
    return smooth_joint(joint, rate, *sensors, motion.world_from_a, b, shared)


def relative_errors(found, motion):
    """Return the angle, deg, between each estimate's rotation from b to a and the true one."""
    true = rotation.multiply(rotation.inverse(motion.world_from_a), motion.world_from_b)
    relative = rotation.multiply(rotation.inverse(found.world_from_a), found.world_from_b)
    return np.degrees(rotation.angle_between(relative, true))


@pytest.mark.parametrize(("axes", "angle"), [(1, np.pi), (2, 0.0), (3, -2.6)])
def test_the_heading_is_right_from_the_first_sample(pendulum, axes, angle):
    motion = pendulum(axes, 20.0, RATE, seed=axes)
    found = smooth(motion, angle)
    assert np.max(relative_errors(found, motion)) < 0.7
    assert np.max(np.abs(np.degrees(rotation.wrap(found.heading_rad + angle)))) < 0.5


@pytest.mark.parametrize(("rate", "most"), [(25.0, 2.0), (200.0, 0.2)])
def test_errors_of_exact_readings_vanish_with_the_rate(pendulum, rate, most):
    motion = pendulum(3, 20.0, rate, seed=8)
    assert np.max(relative_errors(smooth(motion, 1.0, rate=rate), motion)) < most


def test_looking_back_is_no_worse_than_looking_ahead(pendulum):
    motion = pendulum(3, 30.0, RATE, seed=9)
    random = np.random.default_rng(0)
    for values, sd in ((motion.gyr_a, 0.01), (motion.gyr_b, 0.01), (motion.acc_a, 0.2), (motion.acc_b, 0.2)):
        values += sd * random.normal(size=values.shape)
    joint = Joint(axes=3, lever_a=motion.lever_a, lever_b=motion.lever_b)
    tracker = JointFilter(joint, RATE)
    streams = motion.world_from_a, motion.world_from_b, motion.gyr_a, motion.gyr_b, motion.acc_a, motion.acc_b
    live = [tracker.step(*values) for values in zip(*streams, strict=True)]
    a, b = np.array([e.world_from_a for e in live]), np.array([e.world_from_b for e in live])
    relative = rotation.multiply(rotation.inverse(a), b)
    true = rotation.multiply(rotation.inverse(motion.world_from_a), motion.world_from_b)
    ahead = np.degrees(rotation.angle_between(relative, true))[500:]
    found = smooth(motion, 0.0, joint)
    back = relative_errors(found, motion)[500:]
    assert np.mean(back**2) < np.mean(ahead**2)
    assert np.mean(found.heading_sd_rad[500:-250]) < np.mean([e.heading_sd_rad for e in live[500:-250]])
    np.testing.assert_allclose(found.heading_sd_rad[-1], live[-1].heading_sd_rad, rtol=0.1)


def test_blocks_of_the_forward_pass_join(pendulum, monkeypatch):
    motion = pendulum(3, 15.0, RATE, seed=3)
    monkeypatch.setattr("brachium_fusion.joint_smoother.BLOCK_NODES", 10_000)
    whole = smooth(motion, 0.4)
    monkeypatch.setattr("brachium_fusion.joint_smoother.BLOCK_NODES", 99)
    pieces = smooth(motion, 0.4)
    np.testing.assert_allclose(pieces.world_from_b, whole.world_from_b, atol=2e-3)


def test_missing_rows_stay_missing_and_both_sides_are_solved(pendulum):
    motion = pendulum(3, 30.0, RATE, seed=3)
    motion.gyr_a[700:750] = np.nan
    found = smooth(motion, 1.0)
    missing = np.isnan(found.world_from_b).any(axis=1)
    assert np.flatnonzero(missing).tolist() == list(range(700, 750))
    assert np.all(found.heading_sd_rad[700:750] == np.pi)
    assert np.nanmax(relative_errors(found, motion)) < 1.0


@pytest.mark.parametrize("n", [1, 2, 5])
def test_a_few_samples_are_no_trouble(pendulum, n):
    motion = pendulum(3, n / RATE, RATE, seed=3)
    found = smooth(motion, 0.0)
    assert np.isfinite(found.world_from_b).all()
    assert found.heading_sd_rad[0] > 1.0


def test_without_levers_and_axes_orientations_pass(pendulum):
    motion = pendulum(3, 5.0, RATE, seed=1)
    found = smooth(motion, 0.0, Joint(axes=3))
    np.testing.assert_array_equal(found.world_from_b, motion.world_from_b)
    assert np.all(found.heading_sd_rad == np.pi)


@pytest.mark.data
def test_real_recordings_without_any_heading():
    """Recordings of two rigid segments, the heading of one turned: degrees RMS at the best lag."""
    tomllib, table = pytest.importorskip("tomllib"), pytest.importorskip("pyarrow.parquet")
    if not (DATA / "twoseg_1D_02").is_dir():
        pytest.skip(f"no recordings at {DATA}; set BRACHIUM_DATA to their folder")

    def columns(path, names):
        content = table.read_table(path)
        return np.column_stack([np.asarray(content[name], dtype=np.float64) for name in names])

    live, best = [], []
    for name in RECORDINGS:
        folder = DATA / f"twoseg_{name}"
        known = tomllib.loads((folder / "capture.toml").read_text())["joint"]["elbow"]
        segments = "upper_arm_r", "forearm_r"
        joint = Joint(
            axes=known["axes"],
            **{f"lever_{k}": np.array(known[f"from_{s}"]) for k, s in zip("ab", segments, strict=True)},
        )
        sensors, given, true = [], [], []
        for segment in segments:
            gyr, acc = (
                columns(folder / f"{segment}.parquet", names)
                for names in (("gx", "gy", "gz"), ("ax", "ay", "az"))
            )
            sensors.append((gyr, acc))
            given.append(VQF(1.0 / RATE).updateBatch(gyr, acc)["quat6D"])
            true.append(columns(folder / "truth.parquet", [f"{segment}_sensor_q{c}" for c in "wxyz"]))
        given[1] = rotation.multiply(rotation.about(2, 2.0), given[1])
        tracker = JointFilter(joint, RATE)
        streams = *given, sensors[0][0], sensors[1][0], sensors[0][1], sensors[1][1]
        steps = [tracker.step(*values) for values in zip(*streams, strict=True)]
        live.append(lagged_rms([e.world_from_a for e in steps], [e.world_from_b for e in steps], true, 750))
        found = smooth_joint(joint, RATE, *sensors, *given)
        best.append(lagged_rms(found.world_from_a, found.world_from_b, true, 0))
    assert np.mean(live) < LIVE_DEG, f"{np.round(live, 2)}"
    assert np.mean(best) < BEST_DEG, f"{np.round(best, 2)}"


def lagged_rms(a, b, true, first):
    """Return the RMS, deg, at the best of five lags, estimate k + lag belonging to truth k."""
    relative = rotation.multiply(rotation.inverse(a), b)
    reference = rotation.multiply(rotation.inverse(true[0]), true[1])
    k = np.arange(max(first, 2), len(relative) - 2)
    return min(
        float(np.sqrt(np.mean(np.degrees(rotation.angle_between(relative[k + lag], reference[k])) ** 2)))
        for lag in range(-2, 3)
    )
