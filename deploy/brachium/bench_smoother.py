"""What the shoulder's smoother costs a sample: pure reckoning, on an emulated wearer who reaches.

Beside it stands VQF's offline smoothing of the same two sensors: compiled code, whose cost is known.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass
from statistics import median

import numpy as np
from vqf import offlineVQF

from brachium_body import rotation
from brachium_body.segments import Segment
from brachium_fusion.shoulder_model import ArmModel
from brachium_fusion.shoulder_smoother import smooth_shoulder
from brachium_nodes.session import session_arrays
from brachium_nodes.wearer import WearerSettings

RATE_HZ = 100.0
RUNS = 5
SEGMENTS: tuple[Segment, Segment] = ("upper_arm_r", "forearm_r")
STILL = slice(50, 350)
"""Samples: an emulated wearer stands in the pose for its first 4 s."""


@dataclass(frozen=True, kw_only=True)
class SmootherCost:
    """CPU a sample of both sensors, ms: the median of several runs."""

    samples: int
    smoother_ms: float
    vqf_ms: float
    """VQF offline, both sensors."""
    smoother_runs_ms: list[float]
    vqf_runs_ms: list[float]


def measure(seconds: float) -> SmootherCost:
    """Measure on a recording of so many seconds, at 100 Hz."""
    made = session_arrays(
        WearerSettings(exercise="reaching", level="typical", rate_hz=RATE_HZ, seed=1, segments=SEGMENTS),
        seconds,
    )
    arm, (upper, forearm) = made.arms["right"], (made.sensors[s] for s in SEGMENTS)
    mountings = [
        rotation.multiply(
            rotation.inverse(made.sensors[s].world_from_sensor[0]), arm.world_from_segment[s][0]
        )
        for s in SEGMENTS
    ]
    model = ArmModel(
        upper_arm_m=made.lengths.upper_arm,
        forearm_m=made.lengths.forearm,
        sensor_from_upper_arm=mountings[0],
        sensor_from_forearm=mountings[1],
        lever_upper=upper.levers["shoulder"],
        lever_forearm=forearm.levers["elbow"],
        carrying_rad=made.carrying,
        side="right",
    )
    of_upper, of_forearm = (
        (np.ascontiguousarray(x.gyr), np.ascontiguousarray(x.acc)) for x in (upper, forearm)
    )

    def smooth() -> None:
        from_upper, from_forearm = upper.world_from_sensor, forearm.world_from_sensor
        smooth_shoulder(model, RATE_HZ, of_upper, of_forearm, from_upper, from_forearm, STILL)

    def vqf() -> None:
        for gyr, acc in (of_upper, of_forearm):
            offlineVQF(gyr, acc, None, 1.0 / RATE_HZ)

    n = len(upper.gyr)
    smoother, beside = _runs(smooth, n), _runs(vqf, n)
    return SmootherCost(
        samples=n,
        smoother_ms=median(smoother),
        vqf_ms=median(beside),
        smoother_runs_ms=smoother,
        vqf_runs_ms=beside,
    )


def _runs(work: Callable[[], None], samples: int) -> list[float]:
    found = []
    for _ in range(RUNS):
        begun = time.process_time()
        work()
        found.append(1e3 * (time.process_time() - begun) / samples)
    return found
