"""What a session says of a person, in the terms of the arm's model. Pure."""

from math import radians

from brachium_body.assumptions import AS_STATED_BY_DEFAULT, ASSUMABLE, StatedAngles
from brachium_body.lengths import ArmLengths, from_measured
from brachium_body.ranges import check_stated
from brachium_wire.messages import Session

DEFAULT_HEIGHT_M = 1.75
"""Used for lengths while nobody said how tall the subject is."""


def lengths_of(session: Session) -> ArmLengths:
    """Return the arm lengths a session states, completed from height."""
    return from_measured(session.lengths_m, session.height_m or DEFAULT_HEIGHT_M)


def check_session(session: Session) -> None:
    """Raise ValueError naming what of a session no arm has, or what nobody can use."""
    lengths_of(session)
    try:
        check_stated(session.assumed_angles_deg, ASSUMABLE)
    except ValueError as error:
        raise ValueError(f"assumed_angles_deg.{error}") from None


def stated_angles(session: Session) -> StatedAngles:
    """Return the angles of joints that no sensor sees, rad."""
    angles = {name: radians(value) for name, value in session.assumed_angles_deg.items()}
    return StatedAngles(**angles) if angles else AS_STATED_BY_DEFAULT
