"""Angles beyond what a joint can do: kept as they are, and told of. Pure."""

from collections.abc import Mapping

import numpy as np

from brachium_body.angles import COLUMNS
from brachium_body.ranges import PLAUSIBLE, outside_plausible
from brachium_body.segments import Side
from brachium_viewer.metrics.arm_motion import ArmMotion
from brachium_viewer.report import words

LEAST_SHARE = 0.01
"""Of the measured values: fewer are a knock, or a passage through a singularity."""


def implausible(motions: Mapping[Side, ArmMotion]) -> list[str]:
    """Return a line for each angle of an arm that is measured beyond its joint's range too often."""
    found = []
    for side, motion in motions.items():
        known = np.radians(np.stack([motion.known(name) for name in COLUMNS], axis=-1))
        beyond, measured = outside_plausible(known).sum(axis=0), np.isfinite(known).sum(axis=0)
        for i, name in enumerate(COLUMNS):
            if beyond[i] > LEAST_SHARE * measured[i]:
                low, high = PLAUSIBLE[name].ends()
                share = 100.0 * beyond[i] / measured[i]
                found.append(
                    f"{words.ANGLES[name]}, {side}: {share:.0f} % of its values are beyond {low:.0f} to "
                    f"{high:.0f} deg, which no joint does: look how the sensors are worn, and calibrate again"
                )
    return found
