"""How the sensors are worn where it is not as the nodes' names and nominal mountings say."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import hypot
from typing import Literal, get_args

from brachium_body.segments import SEGMENTS, Segment
from brachium_nodes.places import ARRANGEMENTS, Arrangement
from brachium_wire.messages import Quaternion

Turn = Literal["upside-down", "inside-out", "both"]
"""By half a turn: upside-down about z, off the skin; inside-out about y, along the segment; both about x."""

TURNS: dict[Turn, Quaternion] = {
    "upside-down": (0.0, 0.0, 0.0, 1.0),
    "inside-out": (0.0, 0.0, 1.0, 0.0),
    "both": (0.0, 1.0, 0.0, 0.0),
}
"""nominal_from_turned sensor axes."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Wearing:
    """How the sensors are worn."""

    arrangement: Arrangement = "usual"
    seats: Mapping[Segment, Segment] = field(default_factory=dict[Segment, Segment])
    """Nodes that sit on another segment than their name says: {named: really on}. Two that are swapped are
    two entries."""
    turned: Mapping[Segment, Turn] = field(default_factory=dict[Segment, Turn])
    """Sensors put on turned, by the node's name."""
    mounting: Mapping[Segment, Quaternion] = field(default_factory=dict[Segment, Quaternion])
    """The real segment_from_sensor as put on, by the node's name, in place of the nominal one and the strap's
    random angle."""
    slip_segment: Segment | None = None
    """Whose strap slips at a level with a slip; drawn from the seed if None."""
    slip_s: float | None = None
    """When; drawn from 10 to 40 s if None."""

    def __post_init__(self) -> None:
        """Raise ValueError for what cannot be worn so."""
        if self.arrangement not in ARRANGEMENTS:
            raise ValueError(
                f"arrangement {self.arrangement!r} is not known; choose one of {', '.join(ARRANGEMENTS)}"
            )
        for name in (*self.seats, *self.seats.values(), *self.turned, *self.mounting):
            if name not in SEGMENTS:
                raise ValueError(f"segment {name!r} is not known; choose of {', '.join(SEGMENTS)}")
        for turn in self.turned.values():
            if turn not in TURNS:
                raise ValueError(f"turn {turn!r} is not known; choose one of {', '.join(get_args(Turn))}")
        for segment, q in self.mounting.items():
            if len(q) != 4 or abs(hypot(*q) - 1.0) > 1e-6:
                raise ValueError(f"mounting {q} of {segment} is no unit quaternion; give w, x, y, z")
