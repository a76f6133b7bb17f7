"""Skeletons become arrays; what was not measured stays marked."""

from collections.abc import Iterable

import numpy as np
import pytest

from brachium_viewer.metrics.arm_motion import arm_motion
from brachium_wire.codec import encode
from brachium_wire.messages import SegmentPose, Skeleton
from brachium_wire.skeleton_columns import SkeletonCollector, SkeletonColumns


def skeleton(i: int, quality: str = "good", **more: object) -> Skeleton:
    return Skeleton(
        time_ns=1_000_000_000 + 20_000_000 * i,
        side="left",
        origin="emulated",
        forward="elbow",
        trunk_from_world=(1.0, 0.0, 0.0, 0.0),
        segments={"upper_arm_l": SegmentPose(quality="good")},
        positions={"elbow": (0.1 * i, 0.0, 0.0)},
        angles={"elbow_flexion": float(np.radians(10.0 * i)), "shoulder_flexion": 0.5},
        assumed={} if quality == "good" else {"elbow_flexion": quality, "elbow": quality},
        **more,
    )


def columns(skeletons: Iterable[Skeleton]) -> SkeletonColumns:
    collector = SkeletonCollector()
    for one in skeletons:
        collector.take(encode(one), 0)
    return collector.columns()


def test_numbers_times_and_qualities_are_the_skeletons() -> None:
    three = columns([skeleton(0), skeleton(1, "held"), skeleton(2, "disturbed")])
    motion = arm_motion(three, zero_ns=1_000_000_000)
    assert motion.side == "left"
    assert motion.time_s == pytest.approx([0.0, 0.02, 0.04])
    assert motion.angles_deg["elbow_flexion"] == pytest.approx([0.0, 10.0, 20.0])
    assert motion.measured("elbow_flexion").tolist() == [True, False, True]
    assert motion.known("elbow_flexion")[[0, 2]] == pytest.approx([0.0, 20.0])
    assert np.isnan(motion.known("elbow_flexion")[1])
    assert motion.measured("shoulder_flexion").all()
    assert motion.quality["wrist_flexion"].tolist() == ["missing"] * 3
    assert motion.positions_m["elbow"][:, 0] == pytest.approx([0.0, 0.1, 0.2])
    assert np.isnan(motion.positions_m["hand"]).all()
    assert np.isnan(motion.shoulder_shift_m).all()
    assert not motion.with_sternum


def test_a_part_is_the_same_arm_for_a_while() -> None:
    ten = columns(skeleton(i, shoulder_shift=(0.0, 0.0, 0.01 * i)) for i in range(10))
    whole = arm_motion(ten, 1_000_000_000)
    part = whole.between(0.04, 0.1)
    assert part.time_s == pytest.approx([0.04, 0.06, 0.08])
    assert part.shoulder_shift_m[:, 2] == pytest.approx([0.02, 0.03, 0.04])
    assert len(part.quality["elbow"]) == 3


def test_none_is_refused() -> None:
    with pytest.raises(ValueError, match="no skeletons"):
        arm_motion(columns([]))


def test_times_that_do_not_grow_are_refused() -> None:
    with pytest.raises(ValueError, match="do not grow"):
        arm_motion(columns([skeleton(0), skeleton(2), skeleton(1)]))
