"""From our frames to ISB's and to those of other tools. Pure."""

import numpy as np
import numpy.typing as npt

from brachium_body import rotation
from brachium_body.kinematics import TRUNK_FROM_THORAX
from brachium_body.segments import part_of, side_of

Floats = npt.NDArray[np.float64]


def isb(segment: str, world_from_segment: Floats) -> Floats:
    """Return a segment's orientation (n, 4) in ISB's frame of it.

    Forearm and hand are turned by 90 deg about Y, from thumb forward to palm forward; other frames are ISB's.
    """
    if part_of(segment) not in ("forearm", "hand"):
        return world_from_segment
    quarter = np.pi / 2.0 if side_of(segment) == "right" else -np.pi / 2.0
    return rotation.multiply(world_from_segment, rotation.about(1, quarter))


def thorax_from_trunk(places: Floats) -> Floats:
    """Return places (..., 3) in trunk axes in the thorax's: X forward, Y up, Z to the right."""
    return rotation.rotate(rotation.inverse(TRUNK_FROM_THORAX), places)


def zxy_deg(q: Floats) -> Floats:
    """Return the angles (n, 3) deg about Z, X, Y in this order about moving axes, unwrapped, of turns (n, 4).

    At X = +-90 deg only the sum or the difference of Z and Y is determined; any pair with it comes.
    """
    m = rotation.to_matrix(q)
    x = np.arcsin(np.clip(m[..., 2, 1], -1.0, 1.0))
    z, y = np.arctan2(-m[..., 0, 1], m[..., 1, 1]), np.arctan2(-m[..., 2, 0], m[..., 2, 2])
    angles: Floats = np.degrees(np.stack([_unwrapped(z), x, _unwrapped(y)], axis=-1))
    return angles


def _unwrapped(angle: Floats) -> Floats:
    known = np.isfinite(angle)
    out = angle.copy()
    out[known] = np.unwrap(angle[known])
    return out


def isb_wrist_deg(flexion_deg: Floats, deviation_deg: Floats) -> tuple[Floats, Floats]:
    """Return the wrist's flexion and ulnar deviation (n,) deg as turns about Z, then X of ISB's frames.

    Ours are the same two turns in the other order; the twist that is left over does not move the hand's axis.
    """
    f, d = np.radians(flexion_deg), np.radians(deviation_deg)
    first = np.arctan2(np.sin(f), np.cos(d) * np.cos(f))
    return np.degrees(first), np.degrees(np.arcsin(np.sin(d) * np.cos(f)))
