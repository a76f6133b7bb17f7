"""One trial through the system of Zhou et al. 2008, as a user of its text would set it up."""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from brachium.evaluation.emulated import Emulated, Estimate
from brachium.evaluation.trials import STANDING
from brachium_body import rotation
from brachium_body.angles import COLUMNS, joint_angles
from brachium_body.kinematics import TRUNK_FROM_NEUTRAL, TRUNK_FROM_THORAX
from brachium_body.segments import arm_segments
from brachium_fusion.zhou import PRINTED, ZhouMotion, ZhouSensor, ZhouSettings, track
from brachium_fusion.zhou_cycles import LambdaFit, find_cycles, fit_lambda
from brachium_fusion.zhou_strapdown import static_orientation

Floats = npt.NDArray[np.float64]

REPETITION_S = 4.0
"""Of the exercises without rests, whose repetitions no sensor shows."""
CALIBRATION_REPETITIONS = 20


def rest(made: Emulated) -> slice:
    """Return the rows of the pose, in which the person stands still."""
    rate = made.trial.rate_hz
    return slice(round(STANDING[0] * rate), round(STANDING[1] * rate))


def sensors(made: Emulated) -> tuple[ZhouSensor, ZhouSensor]:
    """Return both sensors, aligned by the pose: the arm hangs in neutral and the person faces north."""
    upper, fore, _ = arm_segments(made.trial.side)
    return _sensor(made, upper, "shoulder"), _sensor(made, fore, "elbow")


def _sensor(made: Emulated, segment: str, joint: str) -> ZhouSensor:
    sensor, still = made.session.sensors[segment], rest(made)  # type: ignore[index]
    start = static_orientation(sensor.acc[still], sensor.mag[still])
    sensor_from_segment = rotation.multiply(rotation.inverse(start), TRUNK_FROM_NEUTRAL)
    from_joint = -rotation.rotate(rotation.inverse(sensor_from_segment), sensor.levers[joint])
    return ZhouSensor(
        gyr=sensor.gyr,
        acc=sensor.acc,
        world_from_sensor=start,
        sensor_from_segment=sensor_from_segment,
        place_m=from_joint,
    )


def cycles(made: Emulated) -> list[int]:
    """Return the rows at which the exercise's repetitions begin, as its own movement shows them."""
    upper, fore, _ = arm_segments(made.trial.side)
    begin = made.counts.start
    both = [made.session.sensors[s].gyr[begin:] for s in (upper, fore)]
    found = find_cycles(np.concatenate(both, axis=1), made.trial.rate_hz)
    return [begin + row for row in found] if len(found) > 2 else beats(made)


def beats(made: Emulated) -> list[int]:
    """Return the rows of a beat of REPETITION_S from the exercise's beginning on."""
    return list(range(made.counts.start, len(made.session.time_s), round(REPETITION_S * made.trial.rate_hz)))


def motion(made: Emulated, settings: ZhouSettings, reset: list[int] | None = None) -> ZhouMotion:
    """Return what the system makes of a trial; `reset` are the rows at which drift is reset, its cycles' if
    left out."""
    lengths = made.session.lengths
    return track(
        *sensors(made),
        (lengths.upper_arm, lengths.forearm),
        made.trial.rate_hz,
        rest(made),
        settings,
        cycles(made) if reset is None else reset,
    )


def calibrated_lambda(still_shoulder: Emulated, settings: ZhouSettings) -> LambdaFit:
    """Return lambda from a trial in which the shoulder is still and the arm repeats a movement."""
    found = motion(still_shoulder, settings)
    return fit_lambda(found.s_a, found.s_b, cycles(still_shoulder), still_shoulder.trial.rate_hz)


def estimate(made: Emulated, found: ZhouMotion) -> Estimate:
    """Return the system's movement in the terms of the others: trunk axes from the chest."""
    upper, fore = found.world_from_upper_arm, found.world_from_forearm
    angles = joint_angles(
        rotation.multiply(rotation.inverse(TRUNK_FROM_THORAX), upper),
        rotation.multiply(rotation.inverse(upper), fore),
        np.full((len(upper), 4), np.nan),
        made.trial.side,
    )
    shift = found.shift_m - found.shift_m[0]
    chest_to_shoulder = made.session.lengths.chest_to_shoulder
    start = np.array([chest_to_shoulder if made.trial.side == "right" else -chest_to_shoulder, 0.0, 0.0])
    moved = found.shift_m[0]
    segments = arm_segments(made.trial.side)
    return Estimate(
        world_from_segment={segments[0]: upper, segments[1]: fore},
        positions={
            "shoulder": start + shift,
            "elbow": start + found.elbow_m - moved,
            "wrist": start + found.wrist_m - moved,
        },
        angles={name: np.unwrap(angles[:, i]) for i, name in enumerate(COLUMNS)},
        shift=shift,
    )


def printed(weight: Sequence[float]) -> ZhouSettings:
    """Return the text as it stands, its results taken cycle by cycle as the paper's are."""
    a, b, c = weight
    return ZhouSettings(corrected=PRINTED, weight=(a, b, c), drift="cycle_reset")


CORRECTED = ZhouSettings(drift="cycle_reset")
