"""What a wear check says to people. Pure."""

from typing import Literal

from brachium_body.segments import part_of, side_of

Turn = Literal["", "upside-down", "inside-out", "both"]

OTHER_MOVEMENT = (
    "the movement that was asked for was not seen: no sensor felt an arm that hangs, is raised sideways to "
    "shoulder height and let down, and then bends its elbow; repeat the check with these movements alone"
)
"""Where nothing fits, all sensors are seldom worn wrongly."""

TURN_WORDS: dict[Turn, str] = {
    "upside-down": "is upside down: turn it round on the skin, so that its y arrow points to the shoulder",
    "inside-out": "has its back to the outside: put it on with the other face to the skin",
    "both": "is upside down and has its back to the outside: turn it over end to end",
}


def place(segment: str) -> str:
    """Return where a segment is, as in `right upper arm`."""
    return f"{side_of(segment) or ''} {part_of(segment).replace('_', ' ')}".strip()
