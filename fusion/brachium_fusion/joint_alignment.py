"""What calibration found of one joint, as plain values to keep and to pass on. Pure."""

from dataclasses import asdict, dataclass
from typing import Any

Vector = tuple[float, float, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class JointAlignment:
    """Axes of a joint of two axes in the sensors beside it.

    Elbow: near is the upper arm, far the forearm; wrist: forearm and hand.
    """

    near: str
    """Segment nearer to the trunk."""
    far: str
    axis_near: Vector
    """Unit: elbow flexion in the upper-arm sensor; wrist deviation in the forearm sensor."""
    axis_far: Vector
    """Unit: pronation in the forearm sensor, towards the elbow; wrist flexion in the hand sensor."""
    carrying_rad: float
    """ISB's sign, valgus negative on either side; for the wrist: by how much its axes are not square."""
    heading_rad: float
    """About the vertical, from the left: brings the far sensor's world into the near one's, in the pose."""
    axis_near_sd_rad: float
    axis_far_sd_rad: float
    heading_sd_rad: float
    lever_near_m: Vector | None = None
    """From the near sensor to the joint's centre, in its axes, where accelerations show it."""
    lever_far_m: Vector | None = None

    def state(self) -> dict[str, Any]:
        """Return plain values."""
        return asdict(self)

    @staticmethod
    def from_state(state: dict[str, Any]) -> "JointAlignment":
        """Return the joint of a state."""
        vectors = ("axis_near", "axis_far", "lever_near_m", "lever_far_m")
        given = {k: tuple(state[k]) for k in vectors if state.get(k) is not None}
        return JointAlignment(**{**state, **given})
