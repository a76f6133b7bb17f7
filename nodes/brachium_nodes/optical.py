"""An emulated optical tracker beside the sensors: markers on the skin, at 200 Hz (Zhou 2008, 2.3.2)."""

from dataclasses import dataclass

import numpy as np
from scipy.signal import resample_poly

from brachium_body import rotation
from brachium_body.segments import Side
from brachium_nodes.movement import Array
from brachium_nodes.person import Person
from brachium_nodes.sensors import generator
from brachium_nodes.wearer import Wearer, WearerSettings

RATE_HZ = 200
NOISE_M = 0.0003
"""Standard deviation of a marker along each axis. An assumption: a tracker of active markers at some 2 m."""

_ON_TRUNK: dict[str, tuple[float, float, float]] = {
    "c7": (-0.09, 0.09, 0.0),
    "t5": (-0.13, -0.08, 0.0),
    "trapezius": (-0.05, 0.06, 0.09),
}
"""In the thorax's axes from the chest, m; z is mirrored for a left arm."""
_ON_CHAIR: dict[str, tuple[float, float, float]] = {
    "chair_left": (-0.22, -0.18, 0.05),
    "chair_right": (0.22, -0.18, 0.05),
}
"""In world axes from the pelvis, m."""
_ACROMION = (0.0, 0.035, 0.01)
_EPICONDYLE = (0.0, 0.0, 0.035)
_WRIST = (0.0, 0.0, 0.025)
WAND_M = 0.05


@dataclass(frozen=True, slots=True, eq=False)
class OpticalRecord:
    """Where markers were seen."""

    time_s: Array
    """(n,) true time."""
    rate_hz: float
    markers: dict[str, Array]
    """By name, (n, 3) m in world axes from the chest as it is in neutral. acromion, lateral_epicondyle and
    wrist stand for the joints, and are some centimetres of skin off them; the others for the trunk, the ends
    of the wands on upper arm and forearm, and the chair."""

    def resampled(self, rate_hz: int) -> "OpticalRecord":
        """Return the record at a lower rate that divides its own, low-passed without a shift in time."""
        every = round(self.rate_hz / rate_hz)
        if every * rate_hz != self.rate_hz:
            raise ValueError(f"{rate_hz} Hz does not divide {self.rate_hz:g} Hz; give a rate that does")
        fewer = {
            name: np.asarray(resample_poly(p, 1, every, axis=0, padtype="line"))
            for name, p in self.markers.items()
        }
        return OpticalRecord(self.time_s[::every], float(rate_hz), fewer)


def optical_record(
    settings: WearerSettings, side: Side, to_s: float, from_s: float = 0.0, noise_m: float = NOISE_M
) -> OpticalRecord:
    """Return what a tracker sees of one arm between two true times; the same wearer as the settings' sensors.

    Raises ValueError for a span without samples.
    """
    first, end = round(from_s * RATE_HZ), round(to_s * RATE_HZ)
    if not 0 <= first < end:
        raise ValueError(f"no samples lie between {from_s} and {to_s} s; give times from 0 on, in order")
    t = np.arange(first, end) / RATE_HZ
    random = generator(settings.seed, side, "optical", first)
    seen = _markers(Wearer(settings).person, t, side)
    return OpticalRecord(
        t,
        float(RATE_HZ),
        {name: p + noise_m * random.standard_normal(p.shape) for name, p in seen.items()},
    )


def _markers(person: Person, t: Array, side: Side) -> dict[str, Array]:
    trunk, arm = person.trunk(t), person.arm(t, side)
    home = person.trunk(np.zeros(1)).chest
    outward = np.array([1.0, 1.0, 1.0 if side == "right" else -1.0])
    upper_arm, forearm = arm.world_from["upper_arm"], arm.world_from["forearm"]

    def on(joint: str, bone: Array, place: tuple[float, float, float]) -> Array:
        return arm.joints[joint] - home + rotation.rotate(bone, outward * place)

    wand = np.array([0.0, 0.0, WAND_M])
    found = {
        "acromion": on("shoulder", trunk.world_from_thorax, _ACROMION),
        "lateral_epicondyle": on("elbow", upper_arm, _EPICONDYLE),
        "wrist": on("wrist", forearm, _WRIST),
        **{
            name: trunk.chest - home + rotation.rotate(trunk.world_from_thorax, outward * place)
            for name, place in _ON_TRUNK.items()
        },
        **{name: np.tile(np.array(place) - home[0], (len(t), 1)) for name, place in _ON_CHAIR.items()},
    }
    for name, base, bone in (("upper_arm", "lateral_epicondyle", upper_arm), ("forearm", "wrist", forearm)):
        found[f"{name}_wand"] = found[base] + rotation.rotate(bone, outward * wand)
    return found
