"""The kinds of drawing that the live view is made of: values without a viewer."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
Colour = tuple[int, int, int, int]
"""Red, green, blue, opacity; 0 to 255."""


@dataclass(frozen=True, slots=True, eq=False)
class Capsules:
    """Cylinders with round ends; one of length 0 is a ball. All arrays have one row each."""

    starts: Floats
    """(n, 3) m."""
    ends: Floats
    radii: Floats
    """(n,) m."""
    colours: npt.NDArray[np.uint8]
    """(n, 4) red, green, blue, opacity."""


@dataclass(frozen=True, slots=True, eq=False)
class Trail:
    """Lines through points of the picture."""

    strips: tuple[Floats, ...]
    """(n, 3) m each."""
    colours: tuple[Colour, ...]
    """One a strip."""


@dataclass(frozen=True, slots=True, eq=False)
class Signal:
    """Values of a plot's three lines at times of their own; NaN breaks the lines."""

    times_s: Floats
    """(n,), on the picture's axis."""
    values: Floats
    """(n, 3)."""


@dataclass(frozen=True, slots=True)
class Degrees:
    """The value of one line of a plot; None when it is not known, and then the line is broken."""

    value: float | None


@dataclass(frozen=True, slots=True)
class Lane:
    """The quality that a lane shows from now on."""

    quality: str


@dataclass(frozen=True, slots=True)
class Label:
    """Words that stand at a point of the picture, m."""

    at: tuple[float, float, float]
    text: str


@dataclass(frozen=True, slots=True)
class Range:
    """A plot's reference range, degrees."""

    low: float
    high: float


@dataclass(frozen=True, slots=True)
class Text:
    """A panel of Markdown."""

    markdown: str


@dataclass(frozen=True, slots=True)
class Arm:
    """One line in every plot."""

    subject: str
    side: str
    truth: bool

    @property
    def path(self) -> str:
        """The end of its lines' paths. Lines are drawn in order of their names, so the truth lies below."""
        return f"{'actual' if self.truth else 'estimate'}/{self.subject}_{self.side}"


@dataclass(frozen=True, slots=True)
class Layout:
    """Who is there and which angles they have: what the panels and the camera follow from."""

    arms: tuple[Arm, ...]
    angles: tuple[str, ...]
    title: str
    raw: tuple[tuple[str, str], ...] = ()
    """Subject and segment of every sensor whose raw signals are shown."""
    recorded: bool = False
    """Whether it is of the past and can be played, to and fro."""


Drawing = Capsules | Trail | Signal | Degrees | Range | Lane | Label | Text | Layout
