"""The exercises of an emulated wearer. Angles in deg, shoulder translation in m."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from brachium_nodes.desk import OnDesk, circle, rectangle
from brachium_nodes.irregular import Irregular
from brachium_nodes.motions import Free, Keyframes, Motion, there_and_back


@dataclass(frozen=True, slots=True, kw_only=True)
class Exercise:
    """One row of the table of exercises."""

    name: str
    text: str
    motion: Motion
    assumed_angles_deg: Mapping[str, float] = field(default_factory=dict)
    """Joint angles that hold throughout: what a single sensor cannot see. Left out when the joint moves."""


_FREE = Free(
    {
        "shoulder_flexion": (-10, 70),
        "shoulder_abduction": (5, 60),
        "shoulder_rotation": (-20, 50),
        "elbow_flexion": (15, 110),
        "forearm_pronation": (-40, 70),
        "wrist_flexion": (-30, 30),
        "wrist_deviation": (-15, 8),
    },
    (0.012, 0.02, 0.02),
)

_CUP = {"shoulder_flexion": 50, "shoulder_abduction": 12, "shoulder_rotation": 0, "elbow_flexion": 50,
        "forearm_pronation": 5, "wrist_flexion": -15, "wrist_deviation": 0}  # fmt: skip
_LAP = {"shoulder_flexion": 18, "shoulder_abduction": 10, "shoulder_rotation": 25, "elbow_flexion": 80,
        "forearm_pronation": 45, "wrist_flexion": -5, "wrist_deviation": 0}  # fmt: skip
_MOUTH = {"shoulder_flexion": 50, "shoulder_abduction": 30, "shoulder_rotation": 30, "elbow_flexion": 122,
          "forearm_pronation": 0, "wrist_flexion": -10, "wrist_deviation": -5}  # fmt: skip
_SIP = {**_MOUTH, "shoulder_abduction": 38, "forearm_pronation": 22, "wrist_deviation": 8}
_DRINK = ((0.0, _LAP), (0.14, _CUP), (0.22, _CUP), (0.42, _MOUTH), (0.48, _SIP), (0.56, _SIP), (0.62, _MOUTH),
          (0.78, _CUP), (0.84, _CUP), (0.96, _LAP), (1.0, _LAP))  # fmt: skip
_HANGING = {"shoulder_flexion": 0.0, "shoulder_abduction": 0.0, "shoulder_rotation": 0.0}
_LIFT = {"shift_up": 0.08, "shift_out": -0.012}
_SHRUG = {**_LIFT, "shoulder_flexion": 2, "shoulder_abduction": 4, "elbow_flexion": 5}
_HANGING_LOOSE = {"shoulder_flexion": 2, "shoulder_abduction": 6, "elbow_flexion": 12}
_HANGING_LIFTED = {"shoulder_flexion": 4, "shoulder_abduction": 10, "elbow_flexion": 17}
_STRAIGHT_WRIST = {"wrist_flexion": 0.0, "wrist_deviation": 0.0}

EXERCISES: dict[str, Exercise] = {
    e.name: e
    for e in (
        Exercise(
            name="elbow-flexion",
            text="bend the elbow from 8 to 88 deg and straighten it again, the arm hanging",
            motion=there_and_back({"elbow_flexion": 8}, {"elbow_flexion": 88, "shoulder_flexion": 2}),
            assumed_angles_deg={
                **_HANGING,
                "forearm_pronation": 0.0,
                **_STRAIGHT_WRIST,
            },
        ),
        Exercise(
            name="shoulder-abduction",
            text="raise the arm sideways from 8 to 80 deg, the elbow straight",
            motion=there_and_back(
                {"shoulder_abduction": 8, "elbow_flexion": 5}, {"shoulder_abduction": 80}, 5.0
            ),
            assumed_angles_deg={"elbow_flexion": 5.0, "forearm_pronation": 0.0},
        ),
        Exercise(
            name="shoulder-abduction-high",
            text="raise the arm sideways from 8 to 150 deg, turning it outwards on the way",
            motion=there_and_back(
                {"shoulder_abduction": 8, "elbow_flexion": 5},
                {"shoulder_abduction": 150, "shoulder_rotation": -40},
                6.0,
            ),
            assumed_angles_deg={"elbow_flexion": 5.0, "forearm_pronation": 0.0},
        ),
        Exercise(
            name="wrist-flexion",
            text="move the hand from 25 deg extension to 55 deg flexion, elbow at 90 deg, thumb up",
            motion=there_and_back(
                {"elbow_flexion": 90, "wrist_flexion": -25}, {"wrist_flexion": 55, "wrist_deviation": 3}, 3.5
            ),
            assumed_angles_deg={**_HANGING, "elbow_flexion": 90.0, "forearm_pronation": 0.0},
        ),
        Exercise(
            name="circle",
            text="draw a circle of 10 cm radius on a desk",
            motion=OnDesk(circle),
            assumed_angles_deg=_STRAIGHT_WRIST,
        ),
        Exercise(
            name="rectangle",
            text="draw a rectangle of 20 by 14 cm on a desk",
            motion=OnDesk(rectangle),
            assumed_angles_deg=_STRAIGHT_WRIST,
        ),
        Exercise(
            name="reaching",
            text="reach forward from elbow 100 to 25 deg and come back, the shoulder in place",
            motion=there_and_back(
                {
                    "elbow_flexion": 100,
                    "shoulder_flexion": 5,
                    "shoulder_abduction": 8,
                    "shoulder_rotation": 10,
                    "forearm_pronation": 40,
                },
                {
                    "elbow_flexion": 25,
                    "shoulder_flexion": 65,
                    "shoulder_abduction": 18,
                    "shoulder_rotation": 0,
                    "forearm_pronation": 60,
                },
                move=0.3,
                hold=0.125,
            ),
        ),
        Exercise(
            name="shrugging",
            text="lift the shoulder by 8 cm and let it down, the arm hanging",
            motion=there_and_back(_HANGING_LOOSE, {**_HANGING_LIFTED, **_LIFT}, move=0.25, hold=0.1),
            assumed_angles_deg={"forearm_pronation": 0.0, **_STRAIGHT_WRIST},
        ),
        Exercise(
            name="forearm-rotation",
            text="turn the forearm from 60 deg supination to 60 deg pronation, elbow at 90 deg",
            motion=there_and_back({"elbow_flexion": 90, "forearm_pronation": -60}, {"forearm_pronation": 60}),
            assumed_angles_deg={
                **_HANGING,
                "elbow_flexion": 90.0,
                "wrist_flexion": 0.0,
                "wrist_deviation": 0.0,
            },
        ),
        Exercise(
            name="scapular-elevation",
            text="raise the arm from 5 to 120 deg in the plane of the scapula, 35 deg in front of the body's",
            motion=there_and_back({"elevation": 5, "plane": 35, "elbow_flexion": 5}, {"elevation": 120}, 6.0),
            assumed_angles_deg={"elbow_flexion": 5.0, "forearm_pronation": 0.0},
        ),
        Exercise(
            name="horizontal-abduction",
            text="swing the level arm over 130 deg, from in front of the chest to behind the body's plane",
            motion=there_and_back({"elevation": 88, "plane": 115, "elbow_flexion": 10}, {"plane": -15}, 5.0),
            assumed_angles_deg={"elbow_flexion": 10.0, "forearm_pronation": 0.0},
        ),
        Exercise(
            name="protraction",
            text="push the shoulder blade forward and pull it back, 6 cm each way, the elbow bent",
            motion=there_and_back(
                {
                    "shift_forward": -0.06,
                    "shoulder_flexion": 30,
                    "shoulder_abduction": 8,
                    "elbow_flexion": 80,
                    "forearm_pronation": 30,
                },
                {"shift_forward": 0.06, "shift_out": -0.02, "shoulder_flexion": 40, "elbow_flexion": 60},
                move=0.25,
                hold=0.1,
            ),
            assumed_angles_deg={"forearm_pronation": 30.0, **_STRAIGHT_WRIST},
        ),
        Exercise(
            name="external-rotation",
            text="turn the upper arm from 60 deg inwards to 50 deg outwards, elbow at the side and at 90 deg",
            motion=there_and_back(
                {"shoulder_abduction": 5, "shoulder_rotation": 60, "elbow_flexion": 90},
                {"shoulder_rotation": -50},
            ),
            assumed_angles_deg={"elbow_flexion": 90.0, "forearm_pronation": 0.0},
        ),
        Exercise(
            name="drinking",
            text="take a cup from the table, drink, put it back, rest the hand on the lap",
            motion=Keyframes(8.0, _DRINK),
        ),
        Exercise(
            name="shrugging-home",
            text="lift the shoulder by 8 cm from neutral and let it down exactly to neutral, with rests",
            motion=there_and_back({}, _SHRUG, move=0.25, hold=0.1, sway_deg=0.0),
        ),
        Exercise(
            name="shrugging-continuous",
            text="lift the shoulder by 8 cm and let it down every 2 s, without a rest",
            motion=there_and_back(_HANGING_LOOSE, {**_HANGING_LIFTED, **_LIFT}, 2.0, move=0.5, hold=0.0),
        ),
        Exercise(
            name="elbow-irregular",
            text="bend the elbow as people do: uneven, with pauses, and tries that give up",
            motion=Irregular({"elbow_flexion": 5}, {"elbow_flexion": 95}),
        ),
        Exercise(
            name="elbow-impaired",
            text="the same with an elbow that begins at 10 to 45 deg, goes 6 to 20 deg, and trembles",
            motion=Irregular({"elbow_flexion": 5}, {"elbow_flexion": 95}, impaired=True),
        ),
        Exercise(
            name="shoulder-irregular",
            text="raise the arm to the front as people do: uneven, with pauses, and tries that give up",
            motion=Irregular({"shoulder_flexion": 5, "elbow_flexion": 5}, {"shoulder_flexion": 100}),
        ),
        Exercise(
            name="shoulder-impaired",
            text="the same with an arm that begins at 10 to 45 deg, goes 6 to 20 deg, and trembles",
            motion=Irregular(
                {"shoulder_flexion": 5, "elbow_flexion": 5}, {"shoulder_flexion": 100}, impaired=True
            ),
        ),
        Exercise(name="free", text="daily movement at random, with pauses", motion=_FREE),
        Exercise(
            name="free-continuous",
            text="daily movement at random, without a pause",
            motion=replace(_FREE, pause_s=0.0),
        ),
    )
}
