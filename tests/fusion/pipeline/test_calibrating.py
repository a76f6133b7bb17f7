"""Poses, commands and sessions act from their instant on, or are refused with the reason."""

import numpy as np
import pytest

from brachium_body import rotation
from brachium_body.kinematics import TRUNK_FROM_NEUTRAL
from brachium_body.lengths import from_height
from brachium_fusion.pipeline import Pipeline
from brachium_fusion.settings import Change, Settings

MS = 1_000_000
TICK = 20 * MS


def test_the_first_three_seconds_of_stillness_calibrate_and_skeletons_before_are_uncalibrated(
    flow, made
) -> None:
    quats, _, _ = flow.worn(made, seconds=6.0)
    pipeline = flow.fed(made.info_messages(quats) + made.orientation_messages(quats))
    (news,) = pipeline.calibrations
    assert news[0] == "p01"
    assert news[1].state == "done"
    assert news[1].time_ns == made.START + 3_000 * MS
    assert set(news[1].mounting) == set(quats)
    for skeleton in flow.published(pipeline):
        wanted = "good" if skeleton.time_ns >= news[1].time_ns else "uncalibrated"
        # nothing says where forward is: every heading is an assumption
        wanted = "heading_assumed" if wanted == "good" and skeleton.forward == "none" else wanted
        assert {p.quality for p in skeleton.segments.values()} == {wanted}


def test_without_auto_pose_nothing_is_calibrated_until_somebody_asks(flow, made) -> None:
    quats, mounting, poses = flow.worn(made, seconds=6.0)
    messages = made.info_messages(quats) + made.orientation_messages(quats)
    plain = flow.fed(messages, Settings(auto_pose=False))
    assert plain.calibrations == []
    assert {p.quality for s in flow.published(plain) for p in s.segments.values()} == {"uncalibrated"}
    wish = {"pose": "n-pose", "seconds": 2.0, "angles_deg": {}}
    asked = flow.fed(
        messages,
        Settings(auto_pose=False),
        changes=[
            flow.session_change(facing_deg=0.0, height_m=1.8),
            Change(made.START + 500 * MS, "calibrate", wish),
        ],
    )
    states = [(c.state, (c.time_ns - made.START) // MS) for _, c in asked.calibrations]
    assert states == [("waiting", 500), ("done", 2_500)]
    for segment, found in asked.calibrations[-1][1].mounting.items():
        assert rotation.angle_between(found, mounting[segment]) < 1e-6
    for skeleton in flow.published(asked)[130:]:
        flow.check(made, skeleton, poses)


def test_a_pose_that_nobody_holds_is_refused_with_the_name_of_who_moved(flow, made) -> None:
    n = 3600
    still = np.tile(TRUNK_FROM_NEUTRAL, (n, 1))
    moving = rotation.multiply(still, rotation.about(0, 0.5 * np.sin(np.arange(n) / 30.0)))
    quats = {"upper_arm_r": still, "forearm_r": moving}
    wish = {"pose": "n-pose", "seconds": 3.0, "angles_deg": {}}
    pipeline = flow.fed(
        made.info_messages(quats) + made.orientation_messages(quats, batch=20),
        Settings(auto_pose=False),
        changes=[Change(made.START, "calibrate", wish)],
    )
    told = [(c.state, c.moving) for _, c in pipeline.calibrations]
    assert told == [("waiting", []), ("waiting", ["forearm_r"]), ("refused", [])]
    assert (pipeline.calibrations[1][1].time_ns - made.START) // MS in (999, 1_000, 1_001)
    last = pipeline.calibrations[-1][1]
    assert "forearm_r was not still" in last.reason
    assert last.time_ns - made.START == pytest.approx(33_000 * MS, abs=2 * TICK)
    assert pipeline.subject("p01").calibrating.alignment is None


def test_a_session_holds_from_its_instant_on(flow, made) -> None:
    quats, _, _ = flow.worn(made, seconds=6.0)
    at = made.START + 4_500 * MS
    messages = made.info_messages(quats) + made.orientation_messages(quats)
    plain = flow.run(messages, changes=[flow.session_change(height_m=1.8, facing_deg=0.0)])
    skeletons = flow.run(
        messages,
        changes=[
            flow.session_change(height_m=1.8, facing_deg=0.0),
            flow.session_change(at, height_m=1.6, facing_deg=0.0),
        ],
    )
    for before, now in zip(plain, skeletons, strict=True):
        shoulder = from_height(1.8 if now.time_ns < at else 1.6).chest_to_shoulder
        assert now.positions["shoulder"][0] == pytest.approx(shoulder, abs=1e-9)
        assert now.angles == before.angles


@pytest.mark.parametrize(
    "fields",
    [
        {"lengths_m": {"upper_arm": 2.5}},
        {"lengths_m": {"leg": 0.8}},
        {"height_m": 0.2},
        {"assumed_angles_deg": {"knee_flexion": 10.0}},
    ],
)
def test_a_session_that_fits_no_person_is_refused_before_it_can_stop_anything(flow, made, fields) -> None:
    pipeline = Pipeline()
    with pytest.raises(ValueError, match=r"leg|length|height|knee"):
        pipeline.apply("p01", flow.session_change(**fields))
    with pytest.raises(ValueError, match="calibrate"):
        pipeline.apply("p01", Change(0, "calibrate", {"pose": "headstand", "seconds": 3.0, "angles_deg": {}}))
    with pytest.raises(ValueError, match="fly"):
        pipeline.apply("p01", Change(0, "fly", {}))
    quats, _, _ = flow.worn(made, seconds=4.0)
    assert (
        len(
            flow.published(
                flow.fed(made.info_messages(quats) + made.orientation_messages(quats), pipeline=pipeline)
            )
        )
        > 190
    )
