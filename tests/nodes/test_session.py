"""Sessions as arrays: the same wearer as the stream's, and a truth that fits its own readings."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from brachium_body.rotation import angle_between, inverse, multiply, rotate
from brachium_nodes.exercises import EXERCISES
from brachium_nodes.routines import ROUTINES
from brachium_nodes.sensors import GRAVITY
from brachium_nodes.session import SessionArrays, session_arrays
from brachium_nodes.wearer import Wearer, WearerSettings


def made(**other: object) -> WearerSettings:
    return WearerSettings(**{"exercise": "reaching", "seed": 5, "rate_hz": 50.0, **other})  # type: ignore[arg-type]


def test_every_sensor_has_readings_and_truth_on_one_grid() -> None:
    s = session_arrays(made(arms="both", segments=("sternum", "forearm_r", "hand_l")), 6.0, 2.0)
    assert s.time_s.tolist() == [k / 50.0 for k in range(100, 300)]
    assert set(s.sensors) == {"sternum", "forearm_r", "hand_l"}
    assert set(s.arms) == {"right", "left"}
    for sensor in s.sensors.values():
        assert sensor.gyr.shape == sensor.acc.shape == sensor.mag.shape == (200, 3)
        assert sensor.world_from_sensor.shape == (200, 4)


def test_spans_of_one_session_agree_where_they_overlap() -> None:
    whole, late = (
        session_arrays(made(level="typical"), 20.0),
        session_arrays(made(level="typical"), 20.0, 12.0),
    )
    for segment, sensor in late.sensors.items():
        for name in ("gyr", "acc", "mag"):
            assert np.abs(getattr(whole.sensors[segment], name)[600:] - getattr(sensor, name)).max() < 1e-3
    wrist = "wrist"
    assert (
        np.abs(
            whole.arms["right"].world_positions[wrist][600:] - late.arms["right"].world_positions[wrist]
        ).max()
        < 1e-12
    )


def test_a_session_is_the_stream_of_a_wearer_whose_clocks_are_right() -> None:
    stated = made(level="ideal", skew_ppm=0.0)
    s, wearer = session_arrays(stated, 4.0, raw=True), Wearer(stated)
    for segment, sensor in s.sensors.items():  # standing still, the sampling instants do not matter
        stream = wearer.samples(segment, 0, 190)
        assert np.abs(sensor.acc[:190] - stream.acc).max() < 0.01
        assert np.abs(sensor.gyr[:190] - stream.gyr).max() < 0.002


def test_raw_readings_are_far_off_and_their_calibration_mends_them() -> None:
    raw, done = session_arrays(made(), 4.0, raw=True), session_arrays(made(), 4.0)
    for segment, sensor in raw.sensors.items():
        up = rotate(inverse(sensor.world_from_sensor), -GRAVITY)
        assert np.linalg.norm((sensor.acc - up).mean(axis=0)) > 0.2
        assert np.linalg.norm((done.sensors[segment].acc - up).mean(axis=0)) < 0.2
        assert np.linalg.norm(sensor.gyr.mean(axis=0)) > 5.0 * np.linalg.norm(
            done.sensors[segment].gyr.mean(axis=0)
        )


@pytest.mark.parametrize("arms", ["right", "left"])
def test_without_errors_readings_are_what_the_truth_moves_like(arms: str) -> None:
    """Central differences of positions and scipy's rotations judge the readings."""
    s = session_arrays(made(level="exact", arms=arms, rate_hz=400.0, carrying_deg=8.0), 9.0, 5.0)
    end = arms[0]
    for segment, near in (
        (f"upper_arm_{end}", "shoulder"),
        (f"forearm_{end}", "elbow"),
        (f"hand_{end}", "wrist"),
    ):
        sensor, arm = s.sensors[segment], s.arms[arms]  # type: ignore[index]
        q = Rotation.from_quat(sensor.world_from_sensor, scalar_first=True)
        place = arm.world_positions[near] - q.apply(sensor.levers[near])
        acceleration = (place[2:] - 2.0 * place[1:-1] + place[:-2]) * 400.0**2
        assert np.abs(q[1:-1].inv().apply(acceleration - GRAVITY) - sensor.acc[1:-1]).max() < 5e-3
        turn = (q[:-2].inv() * q[2:]).as_rotvec() * 200.0
        assert np.abs(turn - sensor.gyr[1:-1]).max() < 1e-3


def joints(s: SessionArrays, segment: str, end: str) -> np.ndarray:
    sensor = s.sensors[segment]  # type: ignore[index]
    return rotate(sensor.world_from_sensor, sensor.levers[end])


def test_levers_of_neighbours_meet_in_their_joint() -> None:
    s = session_arrays(made(level="exact", height_m=1.6), 12.0)
    arm = s.arms["right"].world_positions
    along = joints(s, "upper_arm_r", "elbow") - joints(s, "upper_arm_r", "shoulder")
    assert np.abs(along - (arm["elbow"] - arm["shoulder"])).max() < 1e-9
    along = joints(s, "forearm_r", "wrist") - joints(s, "forearm_r", "elbow")
    assert np.abs(along - (arm["wrist"] - arm["elbow"])).max() < 1e-9


def test_the_mounting_is_the_angle_between_segment_and_sensor() -> None:
    s = session_arrays(made(level="ideal", arms="left"), 10.0)
    for segment, sensor in s.sensors.items():
        bone = s.arms["left"].world_from_segment[segment]
        assert (
            angle_between(multiply(bone, sensor.segment_from_sensor), sensor.world_from_sensor).max() < 1e-7
        )
        off = np.degrees(angle_between(sensor.segment_from_sensor[0], sensor.nominal_mounting))
        assert 1.0 < off < 30.0


def test_the_shoulder_rides_on_a_swaying_trunk() -> None:
    """It turns about the pelvis, 0.45 m below the chest of a person of 1.80 m."""
    s = session_arrays(made(exercise="elbow-flexion", sway_deg=4.0, level="exact"), 60.0)
    shoulder, pelvis = s.arms["right"].world_positions["shoulder"], np.array([0.0, 0.0, -0.45])
    assert np.linalg.norm(shoulder - pelvis, axis=1) == pytest.approx(np.hypot(0.45, 0.2322))
    assert np.sqrt((np.ptp(shoulder, axis=0) ** 2).sum()) > 0.01


def test_half_an_hour_is_one_piece() -> None:
    s = session_arrays(made(level="typical", rate_hz=25.0, segments=("forearm_r",)), 1800.0)
    assert np.isfinite(s.sensors["forearm_r"].acc).all()
    assert len(s.time_s) == 45_000


@pytest.mark.parametrize("span", [(0.0, 0.0), (1.0, 2.0), (5.0, -1.0)])
def test_a_span_without_samples_is_refused(span: tuple[float, float]) -> None:
    with pytest.raises(ValueError, match=str(span[0])):
        session_arrays(made(), *span)


def test_a_calibration_can_be_left_out_of_one_reading_alone() -> None:
    raw, done = session_arrays(made(), 4.0, raw=True), session_arrays(made(), 4.0)
    part = session_arrays(made(), 4.0, raw=("gyr",))
    for segment, sensor in part.sensors.items():
        assert np.array_equal(sensor.gyr, raw.sensors[segment].gyr)
        assert np.array_equal(sensor.acc, done.sensors[segment].acc)
        assert np.array_equal(sensor.mag, done.sensors[segment].mag)


def test_shrugging_with_rests_comes_home_and_without_never_rests() -> None:
    rests = session_arrays(made(exercise="shrugging-home", level="exact", rate_hz=25.0), 46.0, 6.0)
    shift, speed = rests.arms["right"].shoulder_shift, np.linalg.norm(rests.sensors["hand_r"].gyr, axis=1)
    home = np.linalg.norm(shift, axis=1) < 1e-12
    assert 0.3 < home.mean() < 0.5
    for name in ("shoulder_flexion", "shoulder_abduction", "elbow_flexion"):
        assert np.abs(rests.arms["right"].angles[name][home]).max() < 1e-12
    assert speed[home].max() < 1e-9
    on = session_arrays(made(exercise="shrugging-continuous", level="exact", rate_hz=25.0), 46.0, 10.0)
    up = on.arms["right"].shoulder_shift[:, 2]
    assert np.ptp(up) == pytest.approx(0.08, rel=0.04)
    assert 16 <= ((up[1:] > 0.04) & (up[:-1] <= 0.04)).sum() <= 20
    assert (up < 0.002).mean() < 0.25


def test_free_movement_can_go_on_without_a_pause() -> None:
    s = session_arrays(made(exercise="free-continuous", level="exact"), 100.0, 8.0)
    assert np.linalg.norm(s.sensors["hand_r"].gyr, axis=1).min() > 1e-3
    assert s.arms["right"].shoulder_shift.std(axis=0) == pytest.approx([0.012, 0.02, 0.02], rel=0.3)


@given(
    level=st.sampled_from(["exact", "ideal", "typical", "patient"]),
    routine=st.sampled_from(list(ROUTINES)),
    exercise=st.sampled_from(list(EXERCISES)),
    side=st.sampled_from(["right", "left"]),
    seed=st.integers(0, 10_000),
    carrying=st.sampled_from([-3.0, 0.0, 8.0, 15.0]),
    contracture=st.sampled_from([0.0, 35.0]),
)
@settings(max_examples=30, deadline=None)
def test_every_wearer_stands_still_at_first_and_is_told_truly(
    level: str, routine: str, exercise: str, side: str, seed: int, carrying: float, contracture: float
) -> None:
    s = session_arrays(
        made(level=level, routine=routine, exercise=exercise, arms=side, seed=seed, carrying_deg=carrying,
             contracture_deg=contracture, rate_hz=25.0), 70.0,
    )  # fmt: skip
    arm = s.arms[side]  # type: ignore[index]
    assert arm.angles["isb_carrying"] == pytest.approx(s.carrying, abs=1e-9)
    assert np.degrees(arm.angles["elbow_flexion"]).min() > contracture - 15.0
    joints = arm.trunk_positions
    for near, far, part in (("shoulder", "elbow", "upper_arm"), ("elbow", "wrist", "forearm")):
        length = np.linalg.norm(joints[far] - joints[near], axis=1)
        assert length == pytest.approx(getattr(s.lengths, part))
    for segment, sensor in s.sensors.items():
        assert np.isfinite([sensor.gyr, sensor.acc, sensor.mag]).all()
        standing = sensor.world_from_sensor[s.time_s < 4.0]
        assert np.degrees(angle_between(standing, standing[0])).max() < 0.6, segment
