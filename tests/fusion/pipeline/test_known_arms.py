"""Known arms in, skeletons out: angles and positions are those that were put in."""

import numpy as np
import pytest

from brachium_body.angles import ELBOW, SHOULDER, WRIST
from brachium_body.kinematics import JOINTS

MS = 1_000_000


@pytest.mark.parametrize("sternum", [False, True])
@pytest.mark.parametrize("sides", [("right",), ("left",), ("right", "left")])
def test_known_arms_come_out_as_they_are(flow, made, sides, sternum) -> None:
    facing = 0.7
    quats, mounting, poses = flow.worn(made, sides, sternum, facing=facing)
    messages = made.info_messages(quats, mounting={"sternum": mounting.get("sternum")}, magnetometer=True)
    skeletons = flow.run(
        messages + made.orientation_messages(quats),
        changes=[flow.session_change(height_m=1.8, facing_deg=float(np.degrees(facing)))],
    )
    calibrated = [s for s in skeletons if s.time_ns >= made.START + 3_100 * MS]
    assert {s.side for s in calibrated} == set(sides)
    assert len(calibrated) >= len(sides) * 190
    for skeleton in calibrated:
        assert skeleton.forward == ("sternum" if sternum else "facing")
        assert skeleton.assumed == {}
        assert all(pose.quality == "good" for pose in skeleton.segments.values())
        flow.check(made, skeleton, poses)


SETS = {
    ("upper_arm_r",): (SHOULDER, (*ELBOW, *WRIST)),
    ("forearm_r",): ((), ELBOW),
    ("hand_r",): ((), WRIST),
    ("forearm_r", "hand_r"): (WRIST, ELBOW),
    ("upper_arm_r", "forearm_r"): ((*SHOULDER, *ELBOW), ()),
    ("upper_arm_r", "hand_r"): (SHOULDER, ()),
}


@pytest.mark.parametrize("only", SETS)
def test_fewer_sensors_give_what_they_can_and_say_what_is_assumed(flow, made, only) -> None:
    quats, _, poses = flow.worn(made, only=only)
    skeletons = flow.run(
        made.info_messages(quats) + made.orientation_messages(quats),
        changes=[flow.session_change(height_m=1.8, facing_deg=0.0)],
    )
    measured, assumed = SETS[only]
    for skeleton in skeletons[170:]:
        assert set(skeleton.segments) == set(only)
        named = {name for name, quality in skeleton.assumed.items() if quality == "assumed"}
        angles = set(skeleton.angles)
        assert angles - named == set(measured)
        assert angles & named == set(assumed) - {"isb_carrying"}
        assert set(skeleton.positions) <= set(JOINTS)
        flow.check(made, skeleton, poses)


@pytest.mark.parametrize("only", [("upper_arm_r",), ("hand_r",)])
def test_what_the_exercise_states_is_used_for_joints_without_sensors(flow, made, only) -> None:
    quats, _, _ = flow.worn(made, only=only, seconds=4.0)
    change = flow.session_change(assumed_angles_deg={"elbow_flexion": 40.0, "forearm_pronation": 10.0})
    skeletons = flow.run(made.info_messages(quats) + made.orientation_messages(quats), changes=[change])
    for skeleton in skeletons:
        angles = skeleton.angles
        if only == ("upper_arm_r",):
            assert angles["elbow_flexion"] == pytest.approx(np.radians(40.0), abs=1e-9)
            assert angles["forearm_pronation"] == pytest.approx(np.radians(10.0), abs=1e-9)
        else:
            assert "elbow_flexion" not in angles
