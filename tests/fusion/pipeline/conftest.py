"""A wearer whose every number is known, a pipeline fed with it, and what came out compared."""

from types import SimpleNamespace

import msgspec
import numpy as np
import pytest

from brachium_body import rotation
from brachium_body.angles import INDEX, SHOULDER, joint_angles
from brachium_body.assumptions import complete
from brachium_body.kinematics import (
    JOINTS,
    TRUNK_FROM_NEUTRAL,
    SegmentOrientations,
    between,
    positions,
)
from brachium_body.lengths import from_height
from brachium_body.segments import arm_segments
from brachium_fusion.pipeline import Pipeline
from brachium_fusion.settings import Change, Settings
from brachium_wire import keys
from brachium_wire.codec import decode, decode_topic, encode
from brachium_wire.messages import SampleBatch, Session, Skeleton

FLOAT32 = 1e-6
"""What float32 quaternions and the slerp between them leave, rad and m."""
NOTHING = np.full(4, np.nan)

Messages = list[tuple[keys.Key, bytes]]


def worn(made, sides=("right",), sternum=False, only=None, seconds=7.0, facing=0.0, seed=1):
    """Return world_from_sensor and segment_from_sensor of each segment, and trunk_from_segment, (n, 4)."""
    random = np.random.default_rng(seed)
    poses = {}
    for i, side in enumerate(sides):
        poses |= made.arm_poses(made.angle_paths(seconds, seed + i), side)
    n = len(next(iter(poses.values())))
    if sternum:
        poses = {"sternum": np.tile(TRUNK_FROM_NEUTRAL, (n, 1))} | poses
    if only is not None:
        poses = {s: q for s, q in poses.items() if s in only or s == "sternum"}
    mounting = {s: made.random_rotation(random) for s in poses}
    world_from_trunk = rotation.about(2, -facing)
    quats = {
        s: rotation.multiply(rotation.multiply(world_from_trunk, q), mounting[s]) for s, q in poses.items()
    }
    return quats, mounting, poses


def fed(messages: Messages, chosen: Settings | None = None, pipeline: Pipeline | None = None, changes=()):
    pipeline = pipeline or Pipeline(chosen)
    for change in changes:
        pipeline.apply("p01", change)
    for key, payload in messages:
        pipeline.feed(key, payload)
    return pipeline


def run(messages: Messages, chosen: Settings | None = None, changes=()) -> list[Skeleton]:
    pipeline = fed(messages, chosen, changes=changes)
    assert not pipeline.drops
    assert not any(s.drops for s in pipeline.subjects.values())
    return published(pipeline)


def published(pipeline: Pipeline) -> list[Skeleton]:
    """Return the skeletons as a reader of the wire has them: what holds a NaN would not come through."""
    return [through_the_wire(solved.skeleton) for solved in pipeline.skeletons()]


def through_the_wire(skeleton: Skeleton) -> Skeleton:
    message = decode_topic(encode(skeleton), "skeleton")
    assert isinstance(message, Skeleton)
    assert message == skeleton
    return message


def difference(a: list[Skeleton], b: list[Skeleton]) -> float:
    """Return the largest difference of any number; infinite where anything else differs."""
    if len(a) != len(b):
        return float("inf")
    worst = 0.0
    for left, right in zip(a, b, strict=True):
        one, two = msgspec.to_builtins(left), msgspec.to_builtins(right)
        worst = max(worst, _difference(one, two))
    return worst


def _difference(a, b) -> float:
    if isinstance(a, dict) and isinstance(b, dict) and a.keys() == b.keys():
        return max((_difference(a[k], b[k]) for k in a), default=0.0)
    if isinstance(a, list | tuple) and isinstance(b, list | tuple) and len(a) == len(b):
        return max((_difference(x, y) for x, y in zip(a, b, strict=True)), default=0.0)
    if isinstance(a, float) and isinstance(b, float):
        return abs(a - b)
    return 0.0 if a == b else float("inf")


FACING = (Change(0, "session", {"m": "session/1", "facing_deg": 0.0, "height_m": 1.8}),)
"""Orientation-only sensors know where north is: with this they know where forward is."""


def session_change(from_ns=0, **fields) -> Change:
    return Change(from_ns, "session", msgspec.to_builtins(Session(**fields)))


def noisy(made, seconds=6.0, seed=2, batch=5) -> Messages:
    """Three sensors' messages, one of which is lost now and then."""
    quats, _, _ = worn(made, seconds=seconds, seed=seed)
    random = np.random.default_rng(seed)
    messages = made.orientation_messages(quats, batch=batch)
    return made.info_messages(quats) + [m for m in messages if random.random() > 0.05]


def time_of(message) -> int:
    return decode(message[1], SampleBatch).time_ns


def check(made, skeleton: Skeleton, poses, height=1.8) -> None:
    row = (skeleton.time_ns - made.START) * int(made.RATE) // 10**9
    segments = SegmentOrientations(
        *(poses.get(s, np.tile(NOTHING, (row + 1, 1)))[row] for s in arm_segments(skeleton.side))
    )
    full = complete(segments, skeleton.side)
    wanted = joint_angles(*between(full), skeleton.side)
    for name, value in skeleton.angles.items():
        if name.startswith("trunk_"):
            assert abs(value) < FLOAT32 * 10
            continue
        near = abs(float(rotation.wrap(value - wanted[INDEX[name]])))
        if name in SHOULDER and name not in ("shoulder_flexion", "shoulder_abduction", "isb_elevation"):
            continue  # singular somewhere, or continued: tested in body
        assert near < 1e-5, (name, value, wanted[INDEX[name]])
    places = positions(*full, np.asarray(from_height(height)), skeleton.side)
    for name, place in skeleton.positions.items():
        assert place == pytest.approx(places[JOINTS.index(name)], abs=FLOAT32 * 5)


@pytest.fixture(scope="session")
def flow() -> SimpleNamespace:
    """What the tests of this folder build from, beside `made`."""
    return SimpleNamespace(
        worn=worn,
        fed=fed,
        run=run,
        published=published,
        difference=difference,
        session_change=session_change,
        noisy=noisy,
        time_of=time_of,
        check=check,
        FACING=FACING,
    )
