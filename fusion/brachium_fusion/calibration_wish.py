"""What may be asked of a calibration, checked at the door. Pure."""

from typing import Any

from brachium_body.ranges import check_stated
from brachium_body.segments import SEGMENTS
from brachium_fusion.guided import MOTIONS
from brachium_fusion.pose import POSES
from brachium_fusion.pose_watch import STILL_S
from brachium_fusion.sensor_guide import ALL
from brachium_wire.sensor_records import SensorStep

ZERO_S = 1.0
"""Headings are set anew after so long of stillness."""

ROUTINES: dict[str, tuple[str, ...]] = {"pose": (), "guided": MOTIONS, "free": ("free",)}
"""By name the movements that follow the pose."""


def checked_wish(arguments: dict[str, Any]) -> dict[str, Any]:
    """Return the arguments of `calibrate`, complete, or raise ValueError saying what may be asked."""
    wish = {"pose": "n-pose", "seconds": STILL_S, "angles_deg": {}, "routine": "pose", "motions": None}
    unknown = sorted(set(arguments) - set(wish))
    if unknown:
        raise ValueError(f"calibrate does not know {unknown[0]!r}; it takes {', '.join(wish)}")
    wish |= arguments
    pose, seconds, angles, routine, motions = wish.values()
    if pose not in POSES:
        raise ValueError(f"calibrate: pose {pose!r} is not known; poses are {', '.join(POSES)}")
    if not isinstance(seconds, int | float) or not 1.0 <= seconds <= 30.0:
        raise ValueError(f"calibrate: seconds must be 1 to 30, not {seconds!r}")
    if not isinstance(angles, dict) or not all(isinstance(v, int | float) for v in angles.values()):
        raise ValueError("calibrate: angles_deg must be a map from an angle's name to degrees")
    if routine not in ROUTINES:
        raise ValueError(f"calibrate: routine {routine!r} is not known; it is {', '.join(ROUTINES)}")
    motions = ROUTINES[routine] if motions is None else motions
    if not isinstance(motions, list | tuple) or not set(motions) <= set(MOTIONS):
        raise ValueError(f"calibrate: motions are some of {', '.join(MOTIONS)}, not {motions!r}")
    if (pose == "given") != bool(angles):
        raise ValueError(
            "calibrate: the pose given, and only that, takes angles_deg: the angles that are held"
        )
    try:
        check_stated(angles)
    except ValueError as error:
        raise ValueError(f"calibrate: angles_deg.{error}") from None
    return {
        "pose": pose,
        "seconds": float(seconds),
        "angles_deg": angles,
        "routine": routine,
        "motions": list(motions),
    }


def checked_zero(arguments: dict[str, Any]) -> dict[str, Any]:
    """Return the arguments of `zero`, complete, or raise ValueError."""
    if set(arguments) - {"seconds"}:
        raise ValueError("zero takes seconds, how long the arms hang still, and nothing else")
    return {"seconds": checked_wish({"seconds": ZERO_S} | arguments)["seconds"]}


def checked_sensor_wish(arguments: dict[str, Any]) -> tuple[str, list[SensorStep] | None]:
    """Return the segment whose sensor is to be calibrated, and the steps (None: all), or raise ValueError."""
    unknown = sorted(set(arguments) - {"sensor", "steps"})
    if unknown:
        raise ValueError(f"calibrate of a sensor does not know {unknown[0]!r}; it takes sensor, steps")
    segment, steps = arguments["sensor"], arguments.get("steps")
    if segment not in SEGMENTS:
        raise ValueError(f"calibrate: segment {segment!r} is not known; it is one of {', '.join(SEGMENTS)}")
    if steps is None:
        return segment, None
    if not isinstance(steps, list | tuple) or not steps or not set(steps) <= set(ALL):
        raise ValueError(f"calibrate: steps are some of {', '.join(ALL)}, not {steps!r}")
    return segment, list(steps)
