"""The emulated optical tracker: markers keep their distance to the joints they stand for."""

import numpy as np
import pytest

from brachium_nodes.optical import NOISE_M, RATE_HZ, WAND_M, optical_record
from brachium_nodes.session import session_arrays
from brachium_nodes.wearer import WearerSettings


def made(**other: object) -> WearerSettings:
    return WearerSettings(**{"exercise": "reaching", "seed": 1, "level": "exact", **other})  # type: ignore[arg-type]


@pytest.mark.parametrize("side", ["right", "left"])
def test_markers_stay_with_the_joints_of_the_same_wearer(side: str) -> None:
    settings = made(arms=side, rate_hz=200.0, sway_deg=3.0)
    seen = optical_record(settings, side, 15.0, noise_m=0.0).markers  # type: ignore[arg-type]
    joints = session_arrays(settings, 15.0).arms[side].world_positions  # type: ignore[index]
    for marker, joint in (("acromion", "shoulder"), ("lateral_epicondyle", "elbow"), ("wrist", "wrist")):
        apart = np.linalg.norm(seen[marker] - joints[joint], axis=1)
        assert np.ptp(apart) < 1e-9
        assert 0.02 < apart[0] < 0.05
    lateral = seen["lateral_epicondyle"] - joints["elbow"]
    assert np.sign(lateral[0, 0]) == (1.0 if side == "right" else -1.0)
    for wand, base in (("upper_arm_wand", "lateral_epicondyle"), ("forearm_wand", "wrist")):
        assert np.linalg.norm(seen[wand] - seen[base], axis=1) == pytest.approx(WAND_M)
    assert np.ptp(seen["chair_left"], axis=0).max() == 0.0
    assert np.ptp(np.linalg.norm(seen["c7"] - seen["t5"], axis=1)) < 1e-9
    assert len(seen) == 10


def test_noise_has_its_size_and_comes_from_the_seed() -> None:
    clean = optical_record(made(), "right", 10.0, noise_m=0.0).markers["wrist"]
    noisy = [optical_record(made(seed=1), "right", 10.0).markers["wrist"] for _ in range(2)]
    assert np.array_equal(noisy[0], noisy[1])
    assert (noisy[0] - clean).std(axis=0) == pytest.approx(np.full(3, NOISE_M), rel=0.1)


def test_resampling_keeps_time_and_movement_and_takes_noise_off() -> None:
    clean, noisy = (optical_record(made(), "right", 20.0, 6.0, noise_m=size) for size in (0.0, 0.002))
    slow = noisy.resampled(25)
    assert slow.rate_hz == 25.0
    assert slow.time_s.tolist() == noisy.time_s[::8].tolist()
    off = (slow.markers["wrist"] - clean.markers["wrist"][::8])[5:-5]
    assert np.ptp(clean.markers["wrist"], axis=0).max() > 0.2
    assert off.std() < 0.5 * 0.002


def test_a_rate_that_does_not_divide_is_refused() -> None:
    with pytest.raises(ValueError, match="30 Hz"):
        optical_record(made(), "right", 1.0).resampled(30)
    assert RATE_HZ == 200
