"""Motions with one moving angle."""

from collections.abc import Callable

import numpy as np
import pytest

from brachium_body.angles import COLUMNS
from brachium_viewer.metrics.arm_motion import JOINTS, ArmMotion

Build = Callable[..., ArmMotion]


def build(
    time_s: np.ndarray,
    angles_deg: dict[str, np.ndarray],
    *,
    hand: np.ndarray | None = None,
    shift: np.ndarray | None = None,
    shift_sd: np.ndarray | None = None,
    with_sternum: bool = False,
) -> ArmMotion:
    """Return a motion; angles that are not given are measured as 0, the trunk's without a sternum missing."""
    n = len(time_s)
    trunk = ("trunk_flexion", "trunk_lateral", "trunk_rotation")
    angles = {c: np.zeros(n) if with_sternum or c not in trunk else np.full(n, np.nan) for c in COLUMNS}
    angles |= angles_deg
    quality = {c: np.where(np.isfinite(v), "good", "missing").astype("<U16") for c, v in angles.items()}
    quality |= {joint: np.full(n, "good", dtype="<U16") for joint in JOINTS}
    places = {joint: np.zeros((n, 3)) for joint in JOINTS}
    if hand is not None:
        places["hand"] = hand
    return ArmMotion(
        side="right",
        origin="emulated",
        time_s=time_s,
        angles_deg=angles,
        quality=quality,
        positions_m=places,
        shoulder_shift_m=np.full((n, 3), np.nan) if shift is None else shift,
        shoulder_shift_sd_m=np.full((n, 3), np.nan) if shift_sd is None else shift_sd,
        sternum=np.full(n, with_sternum),
    )


@pytest.fixture
def motion_of() -> Build:
    return build
