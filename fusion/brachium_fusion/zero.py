"""Headings set anew from an arm that hangs as in the n-pose: mountings stay as they are. Pure."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from brachium_body import rotation
from brachium_fusion.pose import Alignment, pose_orientations

Floats = npt.NDArray[np.float64]


def zeroed(
    alignment: Alignment, world_from_sensor: Mapping[str, Floats], magnetometers: frozenset[str]
) -> Alignment:
    """Return the alignment with headings so that every segment faces forward now.

    `world_from_sensor` (k, 4) per segment while it was still. Sensors with a magnetometer share a world:
    together they say where forward is; each of the others is turned there.
    """
    target = pose_orientations("n-pose", {})
    yaw: dict[str, float] = {}
    for segment, quats in world_from_sensor.items():
        if segment not in alignment.mounting:
            continue
        stands = rotation.multiply(rotation.mean(quats), rotation.inverse(alignment.mounting[segment]))
        yaw[segment] = float(rotation.heading(rotation.multiply(stands, rotation.inverse(target[segment]))))
    common = [yaw[s] + alignment.heading.get(s, 0.0) for s in yaw if s in magnetometers]
    forward = float(rotation.heading(alignment.world_from_trunk))
    if common:
        forward = float(np.angle(np.mean(np.exp(1j * np.array(common)))))
    heading = dict(alignment.heading)
    for segment, own in yaw.items():
        if segment not in magnetometers:
            heading[segment] = float(rotation.wrap(forward - own))
    return replace(
        alignment,
        heading=heading,
        world_from_trunk=rotation.about(2, forward),
        assumed=alignment.assumed - yaw.keys(),
    )
