"""What a reader found in an exported file, by our names and in our frames."""

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]

RIGHT, FORWARD, UP = 2, 0, 1
"""Where trunk axes x, y, z are among X forward, Y up, Z to the right."""


@dataclass(frozen=True, kw_only=True)
class Found:
    """What a reader found in a file; what is missing there is NaN."""

    reader: str
    time_s: Floats
    angles_deg: dict[str, Floats] = field(default_factory=dict)
    places_mm: dict[str, Floats] = field(default_factory=dict)
    held: dict[str, list[list[int]]] = field(default_factory=dict)
    """Of a format that cannot leave anything out: frames that repeat the last one, by joint."""
    whole_instants: bool = False
    """Of a format that leaves out every instant at which one of its numbers is not known."""


def trunk_axes(places: Floats) -> Floats:
    """Return places (n, 3) in thorax axes in the trunk's."""
    return places[:, [RIGHT, FORWARD, UP]]
