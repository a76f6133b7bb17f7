"""Two sensors on one segment: what was put between them is found, and taken out, and nothing else is."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from brachium_body import rotation
from brachium_viewer.arm_track import track
from brachium_viewer.clock_offset import Rates, Unrelated
from brachium_viewer.live_comparison import Hosts, LiveComparison
from brachium_viewer.two_sensors import two_sensors
from brachium_viewer.two_sensors_text import text
from brachium_wire.messages import SegmentPose, Skeleton

START_NS = 10**18
FOREARM, HAND, REACH = 0.26, 0.19, np.array([0.23, 0.0, -0.33])
DEG = np.pi / 180.0


def world_from_segment(t):
    """Return the forearm's orientation (n, 4): flexion with pronation."""
    flexion, pronation = 0.8 - 0.7 * np.cos(1.9 * t), 0.5 * np.sin(1.1 * t)
    upright = np.array([0.5, 0.5, 0.5, 0.5])
    return rotation.multiply(
        rotation.multiply(upright, rotation.about(2, flexion)), rotation.about(1, pronation)
    )


def rates(t, sensor, offset_s):
    h = 1e-4
    q = [rotation.multiply(world_from_segment(t + x), sensor) for x in (-h, h)]
    turn = rotation.to_rotation_vector(rotation.multiply(rotation.inverse(q[0]), q[1]))
    return Rates(t + offset_s, turn / (2 * h))


def skeletons(t, mounting, found, heading_rad=0.0, offset_s=0.0, quality="good"):
    """One subject's: its sensor sits `mounting` on the segment, and fusion believes `found`."""
    out = []
    for time_s, true in zip(t, world_from_segment(t), strict=True):
        sensor = rotation.multiply(rotation.about(2, heading_rad), rotation.multiply(true, mounting))
        segment = rotation.multiply(sensor, rotation.inverse(found))
        down = rotation.rotate(segment, [0.0, -1.0, 0.0])
        places = {"elbow": REACH, "wrist": REACH + FOREARM * down, "hand": REACH + (FOREARM + HAND) * down}
        out.append(
            Skeleton(
                time_ns=START_NS + round(1e9 * (time_s + offset_s)),
                side="right",
                origin="emulated",
                forward="facing",
                trunk_from_world=(1.0, 0.0, 0.0, 0.0),
                segments={
                    "forearm_r": SegmentPose(
                        quality=quality,
                        world_from_segment=tuple(segment.tolist()),
                        world_from_sensor=tuple(sensor.tolist()),
                    )
                },
                positions={name: tuple(p.tolist()) for name, p in places.items()},
                angles={},
            )
        )
    return out


MOUNT_A = rotation.from_rotation_vector([0.3, -0.2, 0.9])
MOUNT_B = rotation.from_rotation_vector([-1.1, 0.4, 0.1])
TILT = rotation.from_rotation_vector(4.0 * DEG * np.array([0.6, 0.0, 0.8]))
"""By which fusion was wrong about the second sensor's mounting."""
T = np.arange(0.0, 30.0, 0.02)


def compared(heading_rad=0.0, offset_s=0.0, wrong=rotation.IDENTITY, truth=None):
    a = track(skeletons(T, MOUNT_A, MOUNT_A), START_NS)
    b = track(skeletons(T, MOUNT_B, rotation.multiply(wrong, MOUNT_B), heading_rad, offset_s), START_NS)
    fast, slow = np.arange(0.0, 30.0, 0.01), np.arange(0.0, 30.0, 1 / 51.2)
    pairs = {"forearm_r": (rates(fast, MOUNT_A, 0.0), rates(slow, MOUNT_B, offset_s))}
    return two_sensors(a, b, pairs, "right", truth)


def test_two_that_agree_agree():
    found = compared()
    for way in (found.as_worn, found.aligned):
        assert way.places["wrist"].apart.max_abs < 1e-4
        assert way.places["hand"].eq17.largest < 1e-4
    assert abs(found.clock.offset_s) < 1e-4
    assert found.removed["forearm_r"].mounting_deg == pytest.approx(0.0, abs=0.02)


def test_what_lies_between_them_is_told_and_taken_out():
    found = compared(heading_rad=-7.0 * DEG, offset_s=0.15, wrong=TILT)
    seat = found.removed["forearm_r"]
    assert found.clock.offset_s == pytest.approx(0.15, abs=3e-4)
    assert seat.mounting_deg == pytest.approx(4.0, abs=0.05)
    assert seat.heading_deg == pytest.approx(7.0, abs=0.05)
    assert found.aligned.places["hand"].apart.max_abs < 1e-3
    assert found.aligned.orientations["forearm_r"].total.max_abs < 0.1


def test_as_worn_is_what_scipy_makes_of_both():
    found = compared(heading_rad=-7.0 * DEG, wrong=TILT)
    true = Rotation.from_quat(world_from_segment(T), scalar_first=True)
    wrong = Rotation.from_quat(MOUNT_B, scalar_first=True)
    wrong = wrong * (Rotation.from_quat(TILT, scalar_first=True) * wrong).inv()
    b = Rotation.from_euler("z", -7.0, degrees=True) * true * wrong
    down = np.array([0.0, -1.0, 0.0])
    wrist_a, wrist_b = (REACH + FOREARM * q.apply(down) for q in (true, b))
    place = found.as_worn.places["wrist"]
    apart = np.linalg.norm(wrist_b - wrist_a, axis=1)
    norms = np.abs(np.linalg.norm(wrist_b, axis=1) - np.linalg.norm(wrist_a, axis=1))
    assert place.apart.rmse == pytest.approx(np.sqrt(np.mean(apart**2)), rel=2e-3)
    assert place.apart.max_abs == pytest.approx(apart.max(), rel=2e-3)
    assert place.eq17.mae == pytest.approx(norms.mean(), rel=2e-3)
    assert place.eq17.rmse == pytest.approx(np.sqrt(np.mean(norms**2)), rel=2e-3)
    assert place.axes["x"].bias == pytest.approx((wrist_b - wrist_a)[:, 0].mean(), rel=2e-3)
    assert found.as_worn.orientations["forearm_r"].total.rmse == pytest.approx(
        np.degrees(np.sqrt(np.mean((b * true.inv()).magnitude() ** 2))), rel=2e-3
    )


def test_each_is_held_against_the_truth_of_its_own_instant():
    truth = track(skeletons(T, MOUNT_A, MOUNT_A, quality="assumed"), START_NS, truth=True)
    found = compared(offset_s=0.2, truth=truth)
    assert found.truth["a"]["wrist"].max_abs < 1e-9
    assert found.truth["b"]["wrist"].max_abs < 1e-3  # 0.2 s later the wrist is decimetres away


@pytest.mark.parametrize("quality", ["uncalibrated", "held", "missing"])
def test_what_was_not_measured_or_not_calibrated_does_not_count(quality):
    b = track(skeletons(T, MOUNT_B, MOUNT_B, quality=quality), START_NS)
    assert not np.isfinite(b.trunk_from["forearm_r"]).any()
    assert not np.isfinite(b.places["wrist"]).any()
    a = track(skeletons(T, MOUNT_A, MOUNT_A), START_NS)
    slow = np.arange(0.0, 30.0, 1 / 51.2)
    pairs = {"forearm_r": (rates(slow, MOUNT_A, 0.0), rates(slow, MOUNT_B, 0.0))}
    with pytest.raises(Unrelated, match="never both calibrated"):
        two_sensors(a, b, pairs, "right")


def test_no_common_segment_is_refused():
    a = track(skeletons(T, MOUNT_A, MOUNT_A), START_NS)
    with pytest.raises(Unrelated, match="no segment carries a sensor of both"):
        two_sensors(a, a, {}, "right")


def test_the_text_states_the_table_and_what_was_taken_out():
    shown = text(
        LiveComparison(
            a="p01",
            b="p01.ref",
            exercise="elbow-flexion",
            origin="emulated",
            chips={"p01": "mpu9150", "p01.ref": "shimmer3"},
            side="right",
            hosts=Hosts(apart_s=1e-3, margin_s=2e-4, stated_s={"p01": 1e-4, "p01.ref": 0.05}),
            found=compared(heading_rad=-7.0 * DEG, offset_s=0.15, wrong=TILT),
            drops={},
        )
    )
    for part in (
        "times of p01.ref are +150.",
        "+1.00 ms +- 0.20 ms apart",
        "the offset is BEYOND that",
        "mounting 4.0 deg, heading +7.0 deg",
        "not worn by a person: emulated",
        "eq 17",
        "the paper      12.6     50.9   16.1",
    ):
        assert part in shown
