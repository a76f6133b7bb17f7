"""SlimeVR's world and its trackers' axes against ours, sign by sign.

SlimeVR's server turns what trackers send by -90 deg about x into the axes of its screens: x right, y up, z to
the back. Its words for where a tracker is worn (mounting) are turns about that y: BACK none, FRONT 180 deg,
LEFT 90 deg, RIGHT -90 deg, applied from the right so that a tracker upright on a body facing forward is the
identity.
"""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from brachium_body.segments import SEGMENTS
from brachium_nodes.slimevr.allowed import usual_mounting
from brachium_nodes.slimevr.datagrams import read
from brachium_nodes.slimevr.positions import SEGMENT_AT

SCREEN_FROM_WORLD = Rotation.from_euler("x", -90, degrees=True)
"""As the server does it."""
RIGHT, FORWARD, UP = np.eye(3)
"""Of a wearer who faces our world's y: x right (east), y forward (north), z up."""
SCREEN = {"right": np.array([1.0, 0, 0]), "up": np.array([0, 1.0, 0]), "back": np.array([0, 0, 1.0])}
MOUNTED = {"front": 180.0, "left": 90.0, "back": 0.0, "right": -90.0}
OFF_THE_SKIN = {"front": FORWARD, "left": -RIGHT, "back": -FORWARD, "right": RIGHT}


def sent_and_read(turn: Rotation) -> Rotation:
    """What we make of a world_from_sensor that a tracker sends."""
    packet = bytes([0, 1]) + turn.as_quat().astype(">f4").tobytes() + b"\0"
    header = (17).to_bytes(4, "big") + (1).to_bytes(8, "big")
    (record,) = read(header + packet).records
    return Rotation.from_quat(record.world_from_sensor, scalar_first=True)


def test_our_world_is_what_the_server_turns_into_its_screens_axes():
    assert SCREEN_FROM_WORLD.apply(RIGHT) == pytest.approx(SCREEN["right"])
    assert SCREEN_FROM_WORLD.apply(UP) == pytest.approx(SCREEN["up"])
    assert SCREEN_FROM_WORLD.apply(FORWARD) == pytest.approx(-SCREEN["back"])


@pytest.mark.parametrize("axis", ["x", "y", "z"])
@pytest.mark.parametrize("deg", [30.0, -30.0])
def test_a_turn_about_each_axis_keeps_its_sense(axis, deg):
    turn = Rotation.from_euler(axis, deg, degrees=True)
    ours = sent_and_read(turn)
    assert (ours.inv() * turn).magnitude() < 1e-6
    along = np.eye(3)["xyz".index(axis)]
    assert ours.apply(along) == pytest.approx(along)
    # right-handed: about z from x to y, about x from y to z, about y from z to x
    start, end = np.roll(np.eye(3), 1 - "yzx".index(axis), axis=0)[:2]
    assert np.sign(ours.apply(start) @ end) == np.sign(deg)


@pytest.mark.parametrize("where", MOUNTED)
def test_a_tracker_worn_as_slimevr_says_has_y_up_and_z_off_the_skin(where):
    mounting = Rotation.from_euler("y", MOUNTED[where], degrees=True)
    # The server's picture of an upright tracker is screen_from_sensor * mounting = identity.
    world_from_sensor = SCREEN_FROM_WORLD.inv() * mounting.inv()
    ours = sent_and_read(world_from_sensor)
    assert ours.apply([0, 1, 0]) == pytest.approx(UP, abs=1e-6)
    assert ours.apply([0, 0, 1]) == pytest.approx(OFF_THE_SKIN[where], abs=1e-6)


NEUTRAL = Rotation.from_matrix(np.column_stack([FORWARD, UP, RIGHT]))
"""Our segments in neutral: X forward, Y up, Z to the subject's right."""


@pytest.mark.parametrize(
    ("segment", "off_the_skin"),
    [
        ("sternum", FORWARD),
        *[(f"{part}_r", RIGHT) for part in ("upper_arm", "forearm", "hand")],
        *[(f"{part}_l", -RIGHT) for part in ("upper_arm", "forearm", "hand")],
    ],
)
def test_the_usual_mounting_is_slimevrs_own_beside_a_hanging_arm(segment, off_the_skin):
    segment_from_sensor = Rotation.from_quat(usual_mounting(segment), scalar_first=True)
    world_from_sensor = NEUTRAL * segment_from_sensor
    assert world_from_sensor.apply([0, 1, 0]) == pytest.approx(UP, abs=1e-6)
    assert world_from_sensor.apply([0, 0, 1]) == pytest.approx(off_the_skin, abs=1e-6)


def test_every_segment_of_ours_has_a_position_of_theirs_left_and_right_not_mixed():
    assert set(SEGMENT_AT.values()) == set(SEGMENTS)
    for position, segment in SEGMENT_AT.items():
        assert position < 10 or segment.endswith("_r" if position % 2 == 0 else "_l")
