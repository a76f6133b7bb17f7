"""A magnetometer's heading that wanders, held steady by the gyroscope."""

import numpy as np

from brachium_body import rotation
from brachium_fusion.steady_heading import steady

RATE = 50.0
MOST_DEG = 3.0
"""Movement without a rest tilts the world that gyroscope and accelerometer see, by about 2 deg."""


def wandering(motion):
    """Return orientations whose heading goes up and down by 15 deg within seconds, and that heading."""
    t = np.arange(len(motion.gyr_a)) / RATE
    away = 0.2 + np.radians(15.0) * np.sin(0.9 * t)
    return rotation.multiply(rotation.about(2, away), motion.world_from_a), away


def heading_error(found, motion):
    return np.unwrap(rotation.heading(rotation.multiply(found, rotation.inverse(motion.world_from_a))))


def test_the_heading_is_one_and_the_mean_of_the_given(pendulum):
    motion = pendulum(3, 40.0, RATE, seed=2)
    given, away = wandering(motion)
    error = heading_error(steady(given, motion.gyr_a, motion.acc_a, RATE), motion)
    assert np.degrees(np.std(error)) < MOST_DEG
    assert abs(np.degrees(np.mean(error) - np.mean(away))) < 1.0


def test_each_side_of_a_gap_has_its_own_mean(pendulum):
    motion = pendulum(3, 40.0, RATE, seed=2)
    given, away = wandering(motion)
    given[900:950] = np.nan
    motion.gyr_a[1200] = np.nan
    found = steady(given, motion.gyr_a, motion.acc_a, RATE)
    assert np.flatnonzero(np.isnan(found[:, 0])).tolist() == [*range(900, 950), 1200]
    for piece in (slice(0, 900), slice(950, 1200), slice(1201, 2000)):
        error = np.unwrap(
            rotation.heading(rotation.multiply(found[piece], rotation.inverse(motion.world_from_a[piece])))
        )
        assert np.degrees(np.std(error)) < MOST_DEG
        assert abs(np.degrees(np.mean(error) - np.mean(away[piece]))) < 1.0
