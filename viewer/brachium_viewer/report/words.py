"""What the report calls things by: measures, angles, exercises, and why a set ended. Pure."""

from collections.abc import Mapping

DISCLAIMER = (
    "Brachium is a measuring and research tool, not a medical device: it diagnoses nothing, scores no "
    "clinical scale and advises no treatment."
)
WITHIN_ERROR = "within measurement error"
SHOULDER = "arm against trunk, never the shoulder joint alone"

MEASURES: Mapping[str, tuple[str, int]] = {
    "start": ("start", 0),
    "peak": ("farthest", 0),
    "range": ("range of motion", 0),
    "peak_speed": ("peak speed", 0),
    "mean_speed": ("mean speed", 0),
    "movement_time": ("movement time", 1),
    "time_to_goal": ("time to goal", 1),
    "hold_time": ("hold at the farthest point", 1),
    "sparc": ("smoothness SPARC", 2),
    "ldlj": ("smoothness LDLJ", 2),
    "hand_path": ("path", 2),
    "straightness": ("straightness", 2),
    "shoulder_shift": ("translation", 3),
    "trunk_lean": ("trunk lean", 0),
}
"""By measure: its name, and the digits that are worth reading."""

NOT_REACHED = "the goal was not reached"
"""Why a time to goal has no number: it is a result, nothing that was withheld."""

NO_COMPONENTS = "fewer than two joint angles were measured and moved"

PATHS: Mapping[str, Mapping[str, str]] = {
    "hand": {"hand_path": "hand path", "straightness": "straightness, hand"},
    "wrist": {"hand_path": "wrist path", "straightness": "straightness, wrist"},
}
"""By the point that a set's path is of: the names of what is measured of it."""

ANGLES: Mapping[str, str] = {
    "elbow_flexion": "elbow flexion",
    "isb_elevation": "elevation of the arm",
    "shoulder_rotation": "shoulder rotation, internal +",
    "forearm_pronation": "forearm pronation",
    "wrist_flexion": "wrist flexion",
    "wrist_deviation": "wrist deviation, ulnar +",
    "shoulder_flexion": "shoulder flexion",
    "shoulder_abduction": "shoulder abduction",
}

FORWARD: Mapping[str, str] = {
    "sternum": "from a sensor on the sternum",
    "elbow": "from led elbow movements: their axis points to the right",
    "facing": "as stated against magnetic north",
    "mounting": "from how the upper arm's sensor is nominally worn",
    "none": "not known: headings are assumed",
}
ENDED: Mapping[str, str] = {"done": "", "stopped": "stopped", "patient-stop": "stopped by the patient"}
STOP_REASONS: Mapping[str, str] = {
    "pain": "pain",
    "tired": "tired",
    "dizzy": "dizzy",
    "other": "another reason",
}


def ended(how: str, reason: str = "") -> str:
    """Return how a set ended, with the patient's reason where they gave one; empty when it was done."""
    return f"stopped by the patient: {STOP_REASONS[reason]}" if reason else ENDED[how]


def exercise(name: str) -> str:
    """Return an exercise's name as people read it."""
    return "free movement" if name == "free" else name.replace("-", " ")


def label(name: str, path_of: str) -> str:
    """Return a measure's name; a path's is that of its point."""
    return PATHS.get(path_of, {}).get(name, MEASURES[name][0])


def movement(name: str, side: str, mode: str = "") -> str:
    """Return what was done by which arm, and how where it is said."""
    return f"{exercise(name)}, {side}" + (f", {mode}" if mode else "")


def scores(found: Mapping[str, float]) -> list[str]:
    """Return the worst of a calibration's scores that a reader can act on: who moved, who sits elsewhere."""
    said = []
    if sway := _worst(found, "sway_deg_"):
        said.append(f"largest sway {sway[0]:.2f} deg ({sway[1]})")
    if off := _worst(found, "from_nominal_deg_"):
        said.append(f"largest way off the stated mounting {off[0]:.1f} deg ({off[1]})")
    return said


def _worst(found: Mapping[str, float], kind: str) -> tuple[float, str] | None:
    """Return the largest score of a kind, and of which segment it is."""
    own = [(value, name.removeprefix(kind)) for name, value in found.items() if name.startswith(kind)]
    value, segment = max(own, default=(0.0, ""))
    return (value, segment.replace("_", " ")) if segment else None
