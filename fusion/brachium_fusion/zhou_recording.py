"""`solve --filter zhou`: one arm of a whole recording by Zhou et al. 2008, printed or corrected. Pure.

It takes the place of best_arm.solve_arm: alignment, lengths and all that follows are the same.
"""

from collections.abc import Mapping
from typing import Literal, get_args

import numpy as np
import numpy.typing as npt

from brachium_body import rotation
from brachium_body.lengths import ArmLengths
from brachium_body.segments import Side, arm_segments
from brachium_fusion.arm_knowledge import Centres, arm_knowledge
from brachium_fusion.best_arm import ArmSolution, Tracked
from brachium_fusion.pose import Alignment
from brachium_fusion.sensor_to_segment import Span
from brachium_fusion.zhou import CORRECTED, PRINTED, ZhouSensor, ZhouSettings, track
from brachium_fusion.zhou_cycles import find_cycles

Floats = npt.NDArray[np.float64]
ZhouName = Literal["zhou", "zhou-printed"]
ZHOU: tuple[ZhouName, ...] = get_args(ZhouName)

NEEDS = "needs raw samples of upper arm and forearm, and a pose at the beginning"


def solve_zhou(
    name: ZhouName,
    side: Side,
    tracked: Mapping[str, Tracked],
    alignment: Alignment | None,
    lengths: ArmLengths,
    stated: Centres,
    pose: Span | None,
    rate_hz: float,
) -> ArmSolution:
    """Return one arm's shoulder, drift reset in each repetition; orientations in `tracked` are replaced.

    Everything begins in the pose, in which the arm is still. Lambda is -1/2; a calibrated one is a property
    of its session (erratum Z6). The shoulder's standard deviation is half of what both sensors differ by.
    """
    solution = ArmSolution(side=side)
    upper, forearm, _ = arm_segments(side)
    if upper not in tracked and forearm not in tracked:
        return solution
    part = f"shoulder_{side[0]}"
    knowledge = arm_knowledge(side, alignment, lengths, stated, [])
    raw = [tracked[s] for s in (upper, forearm) if s in tracked and tracked[s].raw]
    if alignment is None or pose is None or knowledge.model is None or len(raw) != 2:
        solution.refused[part] = NEEDS
        return solution
    levers = {upper: knowledge.model.lever_upper, forearm: knowledge.model.lever_forearm}
    sensors = []
    for segment, one in zip((upper, forearm), raw, strict=True):
        mounting = alignment.mounting[segment]
        gyr, acc = (_filled(values[pose.first :]) for values in one.motion)
        sensors.append(
            ZhouSensor(
                gyr=gyr,
                acc=acc,
                world_from_sensor=rotation.mean(_known(one.world_from_sensor[pose.first : pose.end])),
                sensor_from_segment=rotation.inverse(mounting),
                place_m=-rotation.rotate(mounting, levers[segment]),
            )
        )
    held = pose.end - pose.first
    cycles = [held + c for c in find_cycles(np.concatenate([s.gyr for s in sensors], axis=1)[held:], rate_hz)]
    settings = ZhouSettings(corrected=PRINTED if name == "zhou-printed" else CORRECTED, drift="cycle_reset")
    motion = track(
        sensors[0],
        sensors[1],
        (lengths.upper_arm, lengths.forearm),
        rate_hz,
        slice(0, held),
        settings,
        cycles,
    )
    orientations = (motion.world_from_upper_arm, motion.world_from_forearm)
    for segment, one, found in zip((upper, forearm), raw, orientations, strict=True):
        turned = one.world_from_sensor.copy()
        turned[pose.first :] = rotation.multiply(found, alignment.mounting[segment])
        one.world_from_sensor = turned
    solution.shift = np.full((len(raw[0].world_from_sensor), 2, 3), np.nan)
    solution.shift[pose.first :, 0] = motion.shift_m - motion.shift_m[0]
    solution.shift[pose.first :, 1] = 0.5 * np.abs(motion.s_b - motion.s_b[0])
    solution.parts[part] = f"Zhou et al. 2008, drift reset in each of {max(0, len(cycles) - 1)} cycles"
    return solution


def _known(quats: Floats) -> Floats:
    return quats[np.isfinite(quats[:, 0])]


def _filled(values: Floats) -> Floats:
    """Return values (n, 3) with straight lines across gaps."""
    rows, good = np.arange(len(values)), np.flatnonzero(np.isfinite(values).all(axis=1))
    return np.stack([np.interp(rows, good, values[good, i]) for i in range(3)], axis=1)
