import math

import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from brachium_body import rotation
from brachium_viewer import scene
from brachium_viewer.drawings import Capsules, Degrees, Lane

BONES = (0, 2, 4)  # each followed by its near joint, but for the hand
CHEST = np.array([0.0, 0.0, scene.CHEST_HEIGHT])


def bones(drawing: Capsules) -> np.ndarray:
    return np.linalg.norm(drawing.ends - drawing.starts, axis=1)


@pytest.mark.parametrize("side", ["right", "left"])
def test_bones_run_between_the_positions_and_keep_their_lengths(arm_at, side):
    skeleton = arm_at(1.3, side=side)
    drawing = scene.draw_arm(skeleton, 0.0)
    lengths = bones(drawing)
    assert lengths[lengths > 0.0] == pytest.approx([0.31, 0.26, 0.18], abs=1e-9)
    for bone, (near, far) in zip(
        np.flatnonzero(lengths > 0.0),
        [("shoulder", "elbow"), ("elbow", "wrist"), ("wrist", "hand")],
        strict=True,
    ):
        assert drawing.starts[bone] == pytest.approx(CHEST + skeleton.positions[near], abs=1e-12)
        assert drawing.ends[bone] == pytest.approx(CHEST + skeleton.positions[far], abs=1e-12)
    assert (lengths == 0.0).sum() == 3  # a ball at shoulder, elbow and wrist


def test_each_subject_stands_at_a_place_of_its_own(arm_at):
    first, second = (scene.draw_arm(arm_at(0.4), scene.place_of(n)) for n in (0, 1))
    assert second.starts - first.starts == pytest.approx(
        np.tile([-scene.SPACING, 0.0, 0.0], (len(first.starts), 1))
    )


def test_a_position_that_is_not_known_is_not_drawn_and_nothing_else_is_lost(arm_at):
    whole = arm_at(0.4)
    positions = {name: at for name, at in whole.positions.items() if name != "hand"}
    drawing = scene.draw_arm(msgspec.structs.replace(whole, positions=positions), 0.0)
    assert bones(drawing)[bones(drawing) > 0.0] == pytest.approx([0.31, 0.26])
    assert len(scene.draw_arm(msgspec.structs.replace(whole, positions={}), 0.0).starts) == 0


@pytest.mark.parametrize(
    ("quality", "grey"),
    [
        ("good", False),
        ("uncalibrated", False),
        ("disturbed", False),
        ("heading_assumed", False),
        ("held", True),
        ("missing", True),
        ("assumed", True),
    ],
)
def test_what_is_no_measurement_of_now_is_grey(arm_at, quality, grey):
    drawing = scene.draw_arm(arm_at(0.4, quality=quality), 0.0)
    upper_arm = tuple(drawing.colours[0])
    assert upper_arm == (scene.GREY if grey else scene.PART_COLOUR["upper_arm"])


def test_the_truth_is_translucent_thinner_and_on_paths_of_its_own(arm_at):
    estimate = scene.draw_skeleton("p01", arm_at(0.4), 0.0)
    truth = scene.draw_skeleton("p01", arm_at(0.4), 0.0, truth=True)
    assert not estimate.keys() & truth.keys()
    arm, ghost = estimate["world/p01/right"], truth["world/p01/right_truth"]
    assert isinstance(arm, Capsules)
    assert isinstance(ghost, Capsules)
    assert (arm.colours[:, 3] == 255).all()
    assert (ghost.colours[:, 3] < 255).all()
    assert (ghost.radii < arm.radii).all()
    assert not [path for path in truth if path.startswith("quality/")]


def test_angles_are_degrees_and_an_absent_one_is_no_number(arm_at):
    skeleton = arm_at(0.4)
    known = {name: value for name, value in skeleton.angles.items() if name != "wrist_flexion"}
    drawings = scene.draw_skeleton("p01", msgspec.structs.replace(skeleton, angles=known), 0.0)
    assert drawings["angles/wrist_flexion/estimate/p01_right"] == Degrees(None)
    for name, value in known.items():
        drawn = drawings[f"angles/{name}/estimate/p01_right"]
        assert isinstance(drawn, Degrees)
        assert drawn.value == pytest.approx(value * 180.0 / math.pi, rel=1e-12)
    assert sum(path.startswith("angles/") for path in drawings) == 7


def test_lanes_name_segment_and_quality(arm_at):
    drawings = scene.draw_skeleton("p01", arm_at(0.4, side="left", quality="held"), 0.0)
    lanes = {path: drawing for path, drawing in drawings.items() if isinstance(drawing, Lane)}
    assert lanes == {f"quality/p01/{name}_l": Lane("held") for name in ("upper_arm", "forearm", "hand")}


@given(heading=st.floats(-3.1, 3.1), forward=st.floats(-1.2, 1.2), aside=st.floats(-0.8, 0.8))
def test_a_heading_turns_nobody_and_a_lean_keeps_the_body_rigid(heading, forward, aside):
    upright = scene.draw_body(None, 0.0)
    tilt = rotation.multiply(rotation.about(0, -forward), rotation.about(1, aside))
    world_from_trunk = rotation.multiply(rotation.about(2, heading), tilt)
    turned_only = _skeleton(rotation.inverse(rotation.about(2, heading)))
    leaning = _skeleton(rotation.inverse(world_from_trunk))
    assert scene.draw_body(turned_only, 0.0).starts == pytest.approx(upright.starts, abs=1e-9)
    drawn = scene.draw_body(leaning, 0.0)
    head, hip = -1, CHEST + scene.HIP
    trunk = slice(0, len(scene._TORSO))
    assert np.linalg.norm(drawn.starts[trunk] - hip, axis=1) == pytest.approx(
        np.linalg.norm(upright.starts[trunk] - hip, axis=1), abs=1e-9
    )
    assert drawn.starts[head] == pytest.approx(upright.starts[head])  # the last row is a foot: it stays
    assert abs(float(rotation.heading(scene.lean(leaning)))) < 1e-9


def test_leaning_forward_brings_the_head_forward_and_down():
    upright, bowed = scene.draw_body(None, 0.0), scene.draw_body(_skeleton(rotation.about(0, 0.5)), 0.0)
    head = len(scene._TORSO) - 1
    assert bowed.ends[head, 1] > upright.ends[head, 1] + 0.3
    assert bowed.ends[head, 2] < upright.ends[head, 2]


def test_silence_keeps_the_pose_in_grey_breaks_the_lines_and_empties_the_lanes(arm_at):
    before = scene.draw_skeleton("p01", arm_at(0.4), 0.0)
    after = scene.draw_silence("p01", arm_at(0.4), 0.0)
    assert after.keys() == before.keys()
    arm = after["world/p01/right"]
    assert isinstance(arm, Capsules)
    assert (arm.colours == scene.GREY).all()
    assert arm.ends == pytest.approx(before["world/p01/right"].ends)
    assert {drawing for path, drawing in after.items() if path.startswith("angles/")} == {Degrees(None)}
    assert {drawing for path, drawing in after.items() if path.startswith("quality/")} == {Lane("silent")}


def test_every_quality_of_the_wire_has_a_colour_of_its_own():
    from typing import get_args

    from brachium_wire.messages import Quality

    colours = [scene.QUALITY_COLOUR[name] for name in get_args(Quality)]
    assert len(set(colours)) == len(colours)


def _skeleton(trunk_from_world):
    from brachium_wire.messages import Skeleton

    return Skeleton(
        time_ns=1,
        side="right",
        origin="emulated",
        forward="none",
        trunk_from_world=tuple(map(float, trunk_from_world)),
        segments={},
        positions={},
        angles={},
    )
