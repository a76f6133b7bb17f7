"""What the shoulder's filter and smoother share: the arm as they see it, and the sizes of its errors. Pure.

Two sensors, on upper arm and forearm, each say how the shoulder joint accelerates: the upper arm's through
its lever arm to the shoulder, the forearm's through the elbow and the length of the upper arm (Zhou 2008,
eq 4 to 7, with the lever arms that erratum Z5 asks for). Their errors are few and slow: tilt and heading of
each sensor, biases and scale factors, how the sensor sits. Estimating these together with the shoulder's
displacement is an error-state problem (Sola 2017, "Quaternion kinematics for the error-state Kalman filter").
"""

from dataclasses import dataclass
from math import radians

import numpy as np
import numpy.typing as npt

from brachium_body import rotation
from brachium_body.segments import Side

Floats = npt.NDArray[np.float64]
Bools = npt.NDArray[np.bool_]

GRAVITY = 9.81
"""m/s^2; a sensor at rest reads it upwards."""

FARTHEST_M = 0.2
"""No girdle lets a shoulder go so far: something else moves."""

NOT_OBSERVABLE_WITHOUT_STERNUM = (
    "without a sensor on the sternum, trunk and shoulder movement cannot be told apart: the shoulder's "
    "displacement and the plane of elevation are right only while the back is held still, and displacement "
    "slower than about 0.1 Hz is not seen between rests"
)
"""A warning for people: what two sensors on an arm cannot tell."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ArmModel:
    """One arm with a sensor on its upper arm and one on its forearm; lengths in m, rotations (4,)."""

    upper_arm_m: float
    forearm_m: float
    sensor_from_upper_arm: Floats
    sensor_from_forearm: Floats
    lever_upper: Floats
    """(3,) from the upper arm's sensor to the shoulder, in that sensor's axes."""
    lever_forearm: Floats
    """(3,) from the forearm's sensor to the elbow, in that sensor's axes."""
    carrying_rad: float = 0.0
    """The elbow's angle about X, ISB's sign (valgus negative), the same on both sides."""
    side: Side = "right"
    lever_sd_m: float = 0.01
    """How well lengths and lever arms are known, along each axis: 3 mm measured on the bone, 10 mm with a
    tape between landmarks, 20 mm from body height."""
    soft_tissue: bool = True
    """Worn on skin; False: fixed to the bone, as only an emulator or a test rig can be."""

    def __post_init__(self) -> None:
        """Raise ValueError for what is no arm."""
        for name in ("upper_arm_m", "forearm_m"):
            value = getattr(self, name)
            if not 0.05 < value < 0.7:
                raise ValueError(f"{name} must be a length of 0.05 to 0.7 m, not {value!r}")
        for name, size in (
            ("sensor_from_upper_arm", 4),
            ("sensor_from_forearm", 4),
            ("lever_upper", 3),
            ("lever_forearm", 3),
        ):
            value = np.asarray(getattr(self, name), dtype=np.float64)
            if value.shape != (size,) or not np.isfinite(value).all():
                raise ValueError(f"{name} must be {size} finite numbers, not {getattr(self, name)!r}")
            object.__setattr__(self, name, value)

    @property
    def elbow_from_shoulder(self) -> Floats:
        """(3,) from shoulder to elbow in the axes of the upper arm's sensor."""
        return rotation.rotate(self.sensor_from_upper_arm, [0.0, -self.upper_arm_m, 0.0])

    @property
    def flexion_axis(self) -> Floats:
        """(3,) the elbow's flexion axis, the upper arm's Z, in the axes of its sensor."""
        return rotation.rotate(self.sensor_from_upper_arm, [0.0, 0.0, 1.0])

    @property
    def forearm_axis(self) -> Floats:
        """(3,) the forearm's long axis, its Y, in the axes of its sensor."""
        return rotation.rotate(self.sensor_from_forearm, [0.0, 1.0, 0.0])

    @property
    def hinge(self) -> float:
        """The cosine between flexion axis and long axis of the forearm that the elbow keeps."""
        return float(np.sin(self.carrying_rad if self.side == "right" else -self.carrying_rad))


@dataclass(frozen=True, slots=True, kw_only=True)
class Sizes:
    """Standard deviations of everything that is uncertain, SI and rad.

    Sensors: the MPU-9150's product specification and what a calibration by hand leaves; movement and skin:
    assumptions of this project, stated here.
    """

    gyro_noise: float = radians(0.01)
    """rad/sqrt(s): noise of 0.005 dps/sqrt(Hz), and as much for movement between samples."""
    gyro_bias: float = radians(0.02)
    """rad/s: what a rest of a few seconds leaves, and a minute's walk."""
    gyro_scale: float = 0.006
    accel_bias: float = 0.03
    accel_scale: float = 0.004
    accel_noise: float = 0.02
    """m/s^2 of an acceleration averaged over 0.1 s: the chip's 0.01, and movement between samples."""
    lever: float = 0.002
    """m: what is left of a lever arm's error when its constant part is estimated."""
    mounting: float = radians(0.05)
    """About each axis: how far a sensor sits from where the pose put it."""
    tissue: float = 1e-4
    """rad/rad about each axis: how far skin turns a sensor as a joint beside it moves."""
    hinge: float = radians(0.3)
    """Of the carrying angle; a new error each second."""
    tilt: float = radians(0.4)
    heading: float = radians(1.0)
    """Of each sensor at the start."""
    shoulder_accel: float = 0.28
    """m/s^2/sqrt(Hz): of a shoulder that moves; 0.4 m/s^2 rms with a correlation time of 0.25 s."""
    shift: float = 0.04
    """m: of the displacement of a shoulder that moves; it is a new one every `shift_s`."""
    shift_s: float = 4.0
    still: float = 0.004
    """m: the same of a shoulder held as still as people can."""
    rest_speed: float = 0.002
    """m/s: of a shoulder at rest, each 0.1 s."""
    rest_place: float = 0.005
    """m: how well a shoulder comes back to its place when both segments do."""
    rest_heading: float = radians(1.5)
    """How well the segments' headings do."""


ON_BONE = Sizes()
ON_SKIN = Sizes(
    gyro_noise=radians(0.05),
    accel_noise=0.04,
    lever=0.012,
    mounting=radians(1.0),
    tissue=0.015,
    hinge=radians(1.5),
)
"""A strap settles by a degree or two; a joint's full movement turns the skin beside it by a few degrees."""


@dataclass(frozen=True, slots=True, eq=False)
class ShoulderEstimate:
    """The shoulder after one sample; world axes."""

    shift_m: Floats
    """(3,) displacement since the start; 0 while not valid."""
    covariance: Floats
    """(3, 3) m^2."""
    world_from_upper: Floats
    """(4,) of the upper arm's sensor as if it sat as the model says."""
    world_from_forearm: Floats
    """(4,) of the forearm's."""
    at_rest: bool
    valid: bool
    reason: str
    """Why not; empty while valid."""


def sizes(model: ArmModel) -> Sizes:
    """Return the sizes of the errors of an arm's sensors."""
    return ON_SKIN if model.soft_tissue else ON_BONE


MOST_SCALE = 0.1
CALIBRATED_SCALE = 0.01


def gravity_scale(acc: Floats) -> float:
    """Return the scale error of an accelerometer that reads `acc` (3,) m/s^2 at rest: 1 or 2 % in a chip that
    nobody calibrated. More than MOST_SCALE is no rest, or another unit; less than CALIBRATED_SCALE may as
    well be bias, and counts as 0."""
    scale = 1.0 - GRAVITY / max(float(np.linalg.norm(acc)), 1e-6)
    return scale if abs(scale) > CALIBRATED_SCALE else 0.0


def levelled(world_from_sensor: Floats, acc: Floats) -> Floats:
    """Return the orientation (4,) turned the shortest way so that `acc` (3,), of a sensor at rest, is up."""
    up = rotation.rotate(world_from_sensor, acc)
    axis = np.array([up[1], -up[0], 0.0])
    across = float(np.hypot(up[0], up[1]))
    turn = axis / max(across, 1e-12) * np.arctan2(across, up[2])
    return rotation.multiply(rotation.from_rotation_vector(turn), world_from_sensor)
