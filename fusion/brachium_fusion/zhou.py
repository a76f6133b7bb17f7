"""The two-sensor system of Zhou, Stone, Hu, Harris 2008: orientation, elbow, wrist and shoulder translation.

Pure and offline: uniform arrays in, arrays out, of a left or a right arm. World is z up; segment axes are
ours (Y towards the nearer joint), so the paper's [L, 0, 0] along the sensor's x is [0, -L, 0] here. As
printed, or corrected erratum by erratum: Z2 to Z5 are settings, Z1 and Z9 stand where they are applied
(zhou_strapdown.py), Z6 at `weight`.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
import numpy.typing as npt

from brachium_body import rotation
from brachium_fusion.zhou_cycles import cycle_reset
from brachium_fusion.zhou_strapdown import (
    ACC_LOWPASS_HZ,
    GYR_HIGHPASS_HZ,
    displacement,
    filtered,
    nearest_rotation,
    strapdown,
    world_acceleration,
)

Floats = npt.NDArray[np.float64]
Erratum = Literal["Z2", "Z3", "Z4", "Z5"]
DriftMode = Literal["none", "cycle_reset"]

PRINTED: frozenset[Erratum] = frozenset()
CORRECTED: frozenset[Erratum] = frozenset(get_args(Erratum))

MEAN_OF_BOTH = (-0.5, -0.5, -0.5)
"""Lambda as what it is (erratum Z6): -lambda is the weight of the forearm sensor's solution, so this is the
mean of both. The paper's own comes from a calibration (zhou_cycles.fit_lambda)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ZhouSettings:
    """How the text is read."""

    corrected: frozenset[Erratum] = CORRECTED
    """Z2: upper-arm length in eq 4, forearm in eq 5; printed the other way round. Z3: R stays a rotation.
    Z4: the gyroscope's bias learnt at rest is taken off, in place of the 0.05 Hz high-pass, which removes the
    mean angle too. Z5: eq 6 takes the displacement P_e(t) - P_e(0), and sensors where they are, not at the
    joints."""
    weight: tuple[float, float, float] = MEAN_OF_BOTH
    """Lambda's diagonal: l11, l22, l33."""
    drift: DriftMode = "none"
    zero_phase: bool = False
    """Run the filters both ways; the paper does not say. Causal if left out (erratum Z9)."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ZhouSensor:
    """One calibrated sensor over n uniform instants."""

    gyr: Floats
    """(n, 3) rad/s."""
    acc: Floats
    """(n, 3) m/s^2."""
    world_from_sensor: Floats
    """(4,) at the first instant, from the static pose (zhou_strapdown.static_orientation)."""
    sensor_from_segment: Floats
    """(4,)."""
    place_m: Floats
    """(3,) where it sits, from the segment's nearer joint, in segment axes."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ZhouMotion:
    """What the two sensors give; positions in world axes from where the shoulder was at first, m."""

    world_from_upper_arm: Floats
    """(n, 4); of matrices that are none any more (erratum Z3) the nearest rotations."""
    world_from_forearm: Floats
    shift_m: Floats
    """(n, 3), P_s."""
    elbow_m: Floats
    """(n, 3), P_s + P_e."""
    wrist_m: Floats
    """(n, 3), P_s + P_w."""
    s_a: Floats
    """(n, 3), left side of eq 6 without P_s: the shoulder by the upper-arm sensor alone."""
    s_b: Floats
    """(n, 3), left side of eq 7: by how much the forearm sensor says otherwise."""


def track(
    upper_arm: ZhouSensor,
    forearm: ZhouSensor,
    lengths_m: tuple[float, float],
    rate_hz: float,
    rest: slice,
    settings: ZhouSettings | None = None,
    cycles: Sequence[int] = (),
) -> ZhouMotion:
    """Return the movement of one arm.

    `lengths_m` are upper arm and forearm; `rest` are rows in which the arm is still, at the beginning;
    `cycles` the rows at which repetitions begin and the last one's end (zhou_cycles.find_cycles), for the
    reset alone. Raises ValueError for arrays that differ in length, an empty rest or a rate below 20 Hz.
    """
    chosen = settings or ZhouSettings()
    if len(upper_arm.gyr) != len(forearm.gyr) or not len(upper_arm.gyr[rest]):
        raise ValueError(
            f"expected two sensors over the same instants, at rest at first; came {len(upper_arm.gyr)} and "
            f"{len(forearm.gyr)} rows, {len(upper_arm.gyr[rest])} at rest"
        )
    upper_m, fore_m = lengths_m if "Z2" in chosen.corrected else (lengths_m[1], lengths_m[0])
    upper, fore = (_oriented(sensor, rate_hz, rest, chosen) for sensor in (upper_arm, forearm))
    to_elbow = upper.along(upper_m)  # eq 4
    to_wrist = fore.along(fore_m)  # eq 5, from the elbow
    s_a = upper.travelled - to_elbow
    s_b = fore.travelled - upper.travelled - _from_start(to_wrist)
    if "Z5" in chosen.corrected:
        at_upper, at_fore = upper.carried(upper_arm.place_m), fore.carried(forearm.place_m)
        s_a = upper.travelled - _from_start(at_upper)
        s_b = fore.travelled - upper.travelled - _from_start(to_elbow + at_fore - at_upper)
    shift = s_a - np.asarray(chosen.weight) * s_b  # eq 8 where L = 0
    if chosen.drift == "cycle_reset":
        shift = cycle_reset(shift, list(cycles))
    return ZhouMotion(
        world_from_upper_arm=nearest_rotation(upper.world_from_segment),
        world_from_forearm=nearest_rotation(fore.world_from_segment),
        shift_m=shift,
        elbow_m=shift + to_elbow,
        wrist_m=shift + to_elbow + to_wrist,
        s_a=s_a,
        s_b=s_b,
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Oriented:
    """One segment after the front end."""

    world_from_segment: Floats
    """(n, 3, 3)."""
    travelled: Floats
    """(n, 3) m, the sensor's displacement in the world."""

    def along(self, length_m: float) -> Floats:
        """Return the way (n, 3) from the segment's nearer joint to its farther one."""
        return -length_m * self.world_from_segment[:, :, 1]

    def carried(self, place_m: Floats) -> Floats:
        """Return the way (n, 3) from the segment's nearer joint to a place on it."""
        return self.world_from_segment @ place_m


def _oriented(sensor: ZhouSensor, rate_hz: float, rest: slice, settings: ZhouSettings) -> _Oriented:
    both_ways = settings.zero_phase
    acc = filtered(sensor.acc, rate_hz, ACC_LOWPASS_HZ, "lowpass", zero_phase=both_ways)
    if "Z4" in settings.corrected:
        gyr = sensor.gyr - sensor.gyr[rest].mean(axis=0)
    else:
        gyr = filtered(sensor.gyr, rate_hz, GYR_HIGHPASS_HZ, "highpass", zero_phase=both_ways)
    world_from_sensor = strapdown(
        sensor.world_from_sensor, gyr, rate_hz, orthonormal="Z3" in settings.corrected
    )
    acceleration = world_acceleration(world_from_sensor, acc)
    # The arm is still at first, whatever the accelerometer's bias and the error of the first orientation say.
    travelled = displacement(acceleration - acceleration[rest].mean(axis=0), rate_hz)
    return _Oriented(world_from_sensor @ rotation.to_matrix(sensor.sensor_from_segment), travelled)


def _from_start(way: Floats) -> Floats:
    moved: Floats = way - way[0]
    return moved
