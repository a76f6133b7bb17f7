"""What a wearer is led through before the exercise: calibrations, good and bad, and the wear check."""

from collections.abc import Callable

from brachium_nodes.motions import Build
from brachium_nodes.script import Routine, Script

_BENT = {"elbow_flexion": 90.0}
_LOW, _HIGH = {"elbow_flexion": 8.0}, {"elbow_flexion": 110.0}
_SUPINE, _PRONE = {**_BENT, "forearm_pronation": -55.0}, {**_BENT, "forearm_pronation": 55.0}

_SHOULDER = {
    "shoulder_flexion": (0.0, 12.0),
    "shoulder_abduction": (0.0, 8.0),
    "shoulder_rotation": (-8.0, 8.0),
}
_RAISING = {
    "shoulder_flexion": (-5.0, 20.0),
    "shoulder_abduction": (-5.0, 15.0),
    "shoulder_rotation": (-10.0, 10.0),
    "elbow_flexion": (0.0, 15.0),
    "forearm_pronation": (-15.0, 15.0),
}
"""Nobody keeps the shoulder where it was, or raises an arm straight to the side."""


def _functional(script: Script) -> Routine:
    script.repeat("elbow-flexion", _LOW, _HIGH)
    script.repeat("pronation", _SUPINE, _PRONE)
    script.mix(10.0)
    return script.end(_SHOULDER)


def calibration(build: Build) -> Routine:
    """After standing in neutral: five elbow flexions, five pronations at elbow 90, 10 s of both at random."""
    del build
    return _functional(Script())


def table_calibration(build: Build) -> Routine:
    """The same after a pose with the forearm on a table: elbow at 90 deg, thumb up, the upper arm hanging."""
    del build
    script = Script()
    script.hold("table", _BENT)
    return _functional(script)


def given_calibration(build: Build) -> Routine:
    """The same after a pose that a goniometer measures: the elbow as straight as it goes, or at 30 deg."""
    script, limit = Script(), build.contracture_deg
    script.hold("given", {"elbow_flexion": 0.0 if limit else 30.0}, told={"elbow_flexion": limit or 30.0})
    return _functional(script)


def shrugged_calibration(build: Build) -> Routine:
    """Bad: with every repetition the shoulder is lifted and the upper arm swings along."""
    del build
    script, along = Script(), {"shift_up": 0.05, "shoulder_flexion": 40.0, "shoulder_abduction": 25.0}
    script.repeat("elbow-flexion", _LOW, {**_HIGH, **along})
    script.repeat("pronation", _SUPINE, {**_PRONE, **along})
    return script.end(_SHOULDER)


def small_calibration(build: Build) -> Routine:
    """Bad: the arm is hardly moved, by 8 deg."""
    del build
    script = Script()
    script.repeat("elbow-flexion", _LOW, {"elbow_flexion": 16.0})
    script.repeat("pronation", {**_BENT, "forearm_pronation": -4.0}, {**_BENT, "forearm_pronation": 4.0})
    return script.end(_SHOULDER)


def mixed_up_calibration(build: Build) -> Routine:
    """Bad: the forearm turns while the elbow bends, and bends while it turns, always together."""
    del build
    script = Script()
    both = {"elbow_flexion": 100.0, "forearm_pronation": 50.0}
    script.repeat("elbow-flexion", {"elbow_flexion": 10.0, "forearm_pronation": -50.0}, both)
    script.repeat("pronation", {"elbow_flexion": 10.0, "forearm_pronation": -50.0}, both)
    return script.end(_SHOULDER)


def restless_calibration(build: Build) -> Routine:
    """Bad: the arm sways through the pose."""
    del build
    script = Script()
    script.go(1.5, {"sway": 1.0})
    script.wait(4.0)
    script.span("n-pose", 1.5)
    script.repeat("elbow-flexion", _LOW, _HIGH)
    script.repeat("pronation", _SUPINE, _PRONE)
    return script.end(_SHOULDER, sway_deg=12.0)


def wear_check(build: Build) -> Routine:
    """10 s with the last three of standing: hang, raise the arm sideways, bend the elbow."""
    del build
    script = Script()
    script.span("hang", -3.0)
    for kind, there in (("raise", {"shoulder_abduction": 75.0}), ("bend", {"elbow_flexion": 95.0})):
        begin = script.now
        script.go(1.5, {"sway": 1.0, **there})
        script.wait(0.5)
        script.go(1.5, {"posed": 1.0})
        script.span(kind, begin)
    return script.end(_RAISING, rest_s=0.5)


def nothing(build: Build) -> Routine:
    """Stand in neutral."""
    del build
    return Routine()


ROUTINES: dict[str, Callable[[Build], Routine]] = {
    "": nothing,
    "calibration": calibration,
    "calibration-table": table_calibration,
    "calibration-given": given_calibration,
    "calibration-shrugged": shrugged_calibration,
    "calibration-small": small_calibration,
    "calibration-mixed-up": mixed_up_calibration,
    "calibration-restless": restless_calibration,
    "wear-check": wear_check,
}
"""By name; each takes the arm that does it. After `""` the exercise follows at once."""
