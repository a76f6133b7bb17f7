"""The exercises that pages offer and reports measure: one table. Names are those of `session.exercise`."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from brachium_body.ranges import Range

Plane = Literal["abduction", "scaption", "flexion", "extension"]

PLANES_DEG: Mapping[Plane, tuple[float, float]] = {
    "abduction": (-30.0, 30.0),
    "scaption": (30.0, 60.0),
    "flexion": (60.0, 120.0),
    "extension": (-120.0, -60.0),
}
"""Bands of ISB's plane of elevation in which an elevation of the upper arm goes by that name."""

PLANE_FROM_DEG = 20.0
"""Of elevation: below it the plane of a hanging arm is undefined."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Exercise:
    """One exercise: which angle tells what was done, and what a person is told."""

    name: str
    angle: str
    """The angle (angles.COLUMNS) that rises once a repetition."""
    rises: bool = True
    """False: a repetition lowers the angle, and its range is counted downwards."""
    single: bool = True
    """Whether one rise and fall of its angle is all of a repetition. False: it rises on the way as well, so
    that a smaller rise says nothing of what a person tried."""
    straightens: bool = False
    """Whether the elbow is to be straightened: only then is what it lacks a deficit."""
    plane: Plane | None = None
    """Of an elevation: its repetitions count in this band only."""
    goal_deg: float | None = None
    """Where the page's goal stands before a therapist moves it."""
    text: str
    """What a person does, one sentence."""


EXERCISES: Mapping[str, Exercise] = {
    e.name: e
    for e in (
        Exercise(
            name="elbow-flexion",
            angle="elbow_flexion",
            goal_deg=120.0,
            straightens=True,
            text="Bend the elbow, and straighten it again.",
        ),
        Exercise(
            name="elbow-extension",
            angle="elbow_flexion",
            rises=False,
            goal_deg=10.0,
            straightens=True,
            text="Straighten the elbow as far as it goes, and bend it again.",
        ),
        Exercise(
            name="shoulder-flexion",
            angle="isb_elevation",
            plane="flexion",
            goal_deg=120.0,
            text="Raise the arm to the front, and lower it.",
        ),
        Exercise(
            name="shoulder-abduction",
            angle="isb_elevation",
            plane="abduction",
            goal_deg=90.0,
            text="Raise the arm to the side, and lower it.",
        ),
        Exercise(
            name="scapular-elevation",
            angle="isb_elevation",
            plane="scaption",
            goal_deg=120.0,
            text="Raise the arm between front and side, and lower it.",
        ),
        Exercise(
            name="shoulder-extension",
            angle="isb_elevation",
            plane="extension",
            goal_deg=40.0,
            text="Move the arm backwards, and let it come back.",
        ),
        Exercise(
            name="external-rotation",
            angle="shoulder_rotation",
            rises=False,
            goal_deg=-45.0,
            text="Elbow at the side and bent: turn the forearm outwards, and back.",
        ),
        Exercise(
            name="forearm-rotation",
            angle="forearm_pronation",
            goal_deg=60.0,
            text="Elbow bent: turn the palm down, and up again.",
        ),
        Exercise(
            name="wrist-flexion",
            angle="wrist_flexion",
            goal_deg=50.0,
            text="Bend the hand towards the palm, and back.",
        ),
        Exercise(
            name="reaching",
            angle="isb_elevation",
            goal_deg=60.0,
            text="Reach forward, and bring the hand back.",
        ),
        Exercise(
            name="drinking",
            angle="elbow_flexion",
            goal_deg=110.0,
            single=False,
            text="Take a cup to the mouth, and put it back.",
        ),
        Exercise(
            name="free",
            angle="elbow_flexion",
            single=False,
            text="Move as you like.",
        ),
    )
}


def exercise(name: str) -> Exercise:
    """Return the row of this name; one that the table does not hold is measured as free movement."""
    return EXERCISES.get(name, EXERCISES["free"])


def held_against(table: Mapping[str, Range], row: Exercise) -> Range | None:
    """Return what a table of ranges (brachium_body.ranges) says of the angle that an exercise is measured in.

    An elevation in a plane that has a name is held against that movement, from 0 on; any other against none.
    """
    if row.angle != "isb_elevation":
        return table.get(row.angle)
    if row.plane == "extension":
        flexion = table.get("shoulder_flexion")
        return None if flexion is None or flexion.low is None else Range(0.0, -flexion.low)
    found = table.get(f"shoulder_{row.plane}")
    return None if found is None else Range(0.0, found.high)
