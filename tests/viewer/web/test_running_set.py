"""The running set is counted as the report counts it."""

import numpy as np
import pytest

from brachium_viewer.exercises import EXERCISES
from brachium_viewer.marks import ExerciseBegins
from brachium_viewer.metrics.arm_motion import arm_motion
from brachium_viewer.metrics.repetition_measures import count
from brachium_viewer.web.running_set import RunningSet
from brachium_wire.codec import encode
from brachium_wire.messages import SegmentPose, Skeleton
from brachium_wire.skeleton_columns import SkeletonCollector

TIME = np.arange(0.0, 30.0, 0.02)
ANGLE = 10.0 + 40.0 * (1.0 - np.cos(2 * np.pi * TIME / 5.0))
START_NS = 5_000_000_000


def skeleton(time_s: float, angle: float, side: str = "right", quality: str = "good") -> Skeleton:
    return Skeleton(
        time_ns=START_NS + round(1e9 * time_s),
        side=side,  # type: ignore[arg-type]
        origin="emulated",
        forward="elbow",
        trunk_from_world=(1.0, 0.0, 0.0, 0.0),
        segments={"forearm_r": SegmentPose(quality="good")},
        positions={},
        angles={"elbow_flexion": float(np.radians(angle))},
        assumed={} if quality == "good" else {"elbow_flexion": quality},
    )


SKELETONS = [skeleton(t, a) for t, a in zip(TIME, ANGLE, strict=True)]


def running(**more: object) -> RunningSet:
    begins = ExerciseBegins(exercise="elbow-flexion", side="right", **more)  # type: ignore[arg-type]
    return RunningSet(begins, START_NS)


def test_it_counts_up_as_the_report_would() -> None:
    one, counts = running(repetitions=5), []
    for s in SKELETONS:
        one.feed(s)
        counts.append(one.progress().repetitions)
    assert counts == sorted(counts)
    last, recorded = one.progress(), SkeletonCollector()
    for s in SKELETONS:
        recorded.take(encode(s), s.time_ns)
    reported = count(arm_motion(recorded.columns(), START_NS), EXERCISES["elbow-flexion"])
    assert last.repetitions == len(reported.repetitions)
    assert last.done
    assert last.last_deg == pytest.approx(90.0, abs=1.0)
    assert last.best_deg == pytest.approx(90.0, abs=1.0)
    assert last.angle_deg == pytest.approx(ANGLE[-1])


def test_the_other_arm_and_what_was_before_are_left_out() -> None:
    one = running()
    one.feed(skeleton(-1.0, 100.0))
    one.feed(skeleton(1.0, 100.0, side="left"))
    assert one.progress().angle_deg is None


def test_an_angle_that_is_not_measured_is_not_shown() -> None:
    one = running()
    one.feed(skeleton(0.0, 50.0))
    one.feed(skeleton(0.02, 50.0, quality="assumed"))
    assert one.progress().angle_deg is None


@pytest.mark.parametrize(("name", "limit", "inside", "beyond"), [
    ("elbow-flexion", 90.0, 85.0, 95.0),
    ("elbow-extension", 20.0, 25.0, 15.0),
])  # fmt: skip
def test_a_limit_that_is_passed_for_a_while_is_told(
    name: str, limit: float, inside: float, beyond: float
) -> None:
    one = RunningSet(ExerciseBegins(exercise=name, side="right", limit_deg=limit), START_NS)
    told = []
    for i, angle in enumerate([inside] * 10 + [beyond] * 2 + [inside] * 10 + [beyond] * 10 + [inside] * 2):
        one.feed(skeleton(0.02 * i, angle))
        told.append(one.progress().over_limit)
    assert not any(told[:22])
    assert told[31]
    assert not told[-1]
