"""Sensors that deliver orientations without a magnetometer: each has a heading of its own."""

import numpy as np
import pytest

from brachium_body import rotation
from brachium_body.angles import INDEX, joint_angles
from brachium_body.assumptions import complete
from brachium_body.kinematics import SegmentOrientations, between
from brachium_body.segments import arm_segments
from brachium_fusion import best
from brachium_fusion.best_material import Material, TimedSpan
from brachium_fusion.calibration_wish import checked_wish
from brachium_fusion.pipeline import Pipeline
from brachium_fusion.settings import Change, Settings
from brachium_fusion.uniform import Series
from brachium_nodes.session import session_arrays
from brachium_nodes.wearer import WearerSettings
from brachium_wire.codec import decode_topic
from brachium_wire.messages import SampleBatch, Session, Skeleton

MS = 1_000_000
SEGMENTS = arm_segments("right")
MOUNTING = {
    "upper_arm_r": rotation.IDENTITY,
    "forearm_r": rotation.about(1, 0.2),
    "hand_r": rotation.about(1, -0.3),
}
"""segment_from_sensor: turned about the limb, as straps are."""
HEADINGS = {"upper_arm_r": 2.5, "forearm_r": -1.2, "hand_r": 0.4}


def worn(made, seconds: float = 7.0):
    """Return world_from_sensor of three sensors, each in a world of its own, and trunk_from_segment."""
    poses = made.arm_poses(made.angle_paths(seconds, 3))
    quats = {
        s: rotation.multiply(rotation.multiply(rotation.about(2, HEADINGS[s]), poses[s]), MOUNTING[s])
        for s in SEGMENTS
    }
    return quats, poses


def solved(made, quats, **said) -> list[Skeleton]:
    pipeline = Pipeline(Settings())
    infos = made.info_messages(SEGMENTS, mounting=MOUNTING, **said)
    for key, payload in infos + made.orientation_messages(quats):
        pipeline.feed(key, payload)
    assert not pipeline.drops
    return [one.skeleton for one in pipeline.skeletons()]


def worst_deg(made, skeletons: list[Skeleton], poses) -> float:
    """Return how far elbow, forearm and wrist are off at most after the pose, deg."""
    worst = 0.0
    for skeleton in skeletons:
        row = (skeleton.time_ns - made.START) * int(made.RATE) // 10**9
        if row < 320:
            continue
        full = complete(SegmentOrientations(*(poses[s][row] for s in SEGMENTS)), "right")
        wanted = joint_angles(*between(full), "right")
        for name in ("elbow_flexion", "forearm_pronation", "wrist_flexion", "wrist_deviation"):
            off = float(rotation.wrap(skeleton.angles[name] - wanted[INDEX[name]]))
            worst = max(worst, abs(np.degrees(off)))
    return worst


def test_the_nominal_mounting_gives_each_its_heading(made) -> None:
    quats, poses = worn(made)
    skeletons = solved(made, quats, heading_free=True)
    assert worst_deg(made, skeletons, poses) < 0.01
    last = skeletons[-1]
    assert last.forward == "mounting"
    assert {pose.quality for pose in last.segments.values()} == {"good"}
    assert last.shoulder_shift is None


def test_believed_to_share_a_world_they_would_be_far_off(made) -> None:
    quats, poses = worn(made)
    assert worst_deg(made, solved(made, quats), poses) > 20.0


@pytest.mark.parametrize(("silence_ms", "quality"), [(400, "good"), (700, "heading_assumed")])
def test_after_a_silence_in_which_it_may_have_restarted_its_heading_is_in_doubt(
    made, silence_ms, quality
) -> None:
    quats, _ = worn(made, 8.0)
    begin = made.START + 5000 * MS
    silent = range(begin, begin + silence_ms * MS)
    pipeline = Pipeline(Settings())
    infos = made.info_messages(SEGMENTS, mounting=MOUNTING, heading_free=True)
    for key, payload in infos + made.orientation_messages(quats):
        said = decode_topic(payload, key.topic)
        if key.detail != "hand_r" or not (isinstance(said, SampleBatch) and said.time_ns in silent):
            pipeline.feed(key, payload)
    last = [one.skeleton for one in pipeline.skeletons()][-1]
    assert last.segments["hand_r"].quality == quality
    assert last.segments["forearm_r"].quality == "good"


def test_offline_too_each_gets_its_heading(made) -> None:
    quats, poses = worn(made)
    times = np.arange(len(quats["hand_r"])) / made.RATE
    material = Material(
        series={s: Series(time_s=times, rate_hz=made.RATE, quat=q) for s, q in quats.items()},
        infos={
            s: made.info(mounting=tuple(map(float, MOUNTING[s])), heading_free=True, origin="worn")
            for s in SEGMENTS
        },
        sequences={s: np.arange(len(times)) for s in SEGMENTS},
        session=Session(height_m=1.8),
        spans=(TimedSpan(kind="n-pose", from_s=0.5, to_s=3.0),),
        zero_ns=made.START,
    )
    found = best.solve(material, Settings(), times[::2])
    assert worst_deg(made, found.skeletons, poses) < 1.0


def test_a_person_is_led_through_movements_that_only_orientations_show(made) -> None:
    """Bending the elbow tells the headings though nothing is known of how the sensors are put on."""
    chosen = WearerSettings(
        routine="calibration",
        exercise="reaching",
        level="ideal",
        seed=4,
        rate_hz=50.0,
        segments=("upper_arm_r", "forearm_r"),
    )
    session = session_arrays(chosen, 60.0)
    pipeline = Pipeline(Settings(auto_pose=False))
    for segment in session.sensors:
        said = made.info(node=f"n-{segment}", rate_hz=50.0, heading_free=True, origin="worn")
        pipeline.subject("p01").inform(segment, said)
    pipeline.apply("p01", Change(made.START, "calibrate", checked_wish({"routine": "guided"})))
    skeletons: list[Skeleton] = []
    for first in range(0, len(session.time_s) - 5, 5):
        for segment, sensor in session.sensors.items():
            turned = rotation.multiply(rotation.about(2, HEADINGS[segment]), sensor.world_from_sensor)
            pipeline.samples("p01", segment, made.samples(first, rate=50.0, quat=turned[first : first + 5]))
        skeletons += [one.skeleton for one in pipeline.skeletons()]
        for subject, request in pipeline.fits():
            now = pipeline.subject(subject).next_tick_ns()
            pipeline.apply(subject, Change(now, "align", request.fit()))
    told = [news for _, news in pipeline.calibrations]
    assert {"elbow-flexion", "pronation", "free"} <= {news.motion for news in told}
    assert told[-1].state == "done"
    rows = [round((s.time_ns - made.START) * 50e-9) for s in skeletons]
    true = session.arms["right"].angles["elbow_flexion"]
    off = [
        np.degrees(s.angles["elbow_flexion"] - true[row])
        for s, row in zip(skeletons, rows, strict=True)
        if s.time_ns > told[-1].time_ns and row < len(true)
    ]
    assert len(off) > 200
    assert np.sqrt(np.mean(np.square(off))) < 4.0
