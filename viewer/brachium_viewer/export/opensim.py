"""OpenSim: orientations (.sto) for OpenSense, joint angles (.mot), joint centres as markers (.trc)."""

import logging
from pathlib import Path

import numpy as np
import numpy.typing as npt

from brachium_body import rotation
from brachium_body.kinematics import JOINTS
from brachium_body.segments import part_of, suffix
from brachium_viewer.export.about import KEY, one_line, write_sidecar
from brachium_viewer.export.frames import isb, isb_wrist_deg, thorax_from_trunk
from brachium_viewer.export.motion import ArmPath, Motion
from brachium_wire.table import TableError

Floats = npt.NDArray[np.float64]

_log = logging.getLogger(__name__)

OPENSIM_VERSION = "4.6"
BODY = {"sternum": "torso", "upper_arm": "humerus", "forearm": "radius", "hand": "hand"}
"""Bodies of Rajagopal's model, by part."""
MM_PER_M = 1000.0


def write_sto(motion: Motion, path: Path) -> list[Path]:
    """Write orientations of torso, humerus, radius and hand, ISB frames, in a ground with Y up.

    Raises TableError when the motion holds no orientation.
    """
    turns = orientations(motion)
    if not turns:
        raise TableError(
            "an .sto holds orientations, and there are none; leave --columns out or add segments"
        )
    head = [
        f"DataRate={motion.rate_hz:.9g}",
        "DataType=Quaternion",
        "version=3",
        f"OpenSimVersion={OPENSIM_VERSION}",
        f"{KEY}={one_line(motion.about | {'frames': STO_FRAMES})}",
        "endheader",
    ]
    rows = zip(motion.time_s.tolist(), *(map(_quaternion, q.tolist()) for q in turns.values()), strict=True)
    return _write(path, head, ["time", *turns], [[repr(t), *cells] for t, *cells in rows])


STO_FRAMES = (
    "ground: X forward as the trunk faced first, Y up, Z to the right; ISB frames of the segments, which are "
    "those of the model's bodies: sensor_to_opensim_rotations is 0 0 0"
)


def orientations(motion: Motion) -> dict[str, Floats]:
    """Return by `<body>_imu` the ISB frame of each segment (n, 4) in the level ground."""
    turns = {"torso_imu": motion.world_from_thorax}
    for segment, q in motion.world_from_segment.items():
        side = segment[-2:] if segment != "sternum" else ""
        turns[f"{BODY[part_of(segment)]}{side}_imu"] = isb(segment, q)
    ground = motion.ground_from_world
    found = {name: rotation.multiply(ground, q) for name, q in turns.items()}
    return {name: q for name, q in found.items() if np.isfinite(q).any()}


def _quaternion(q: list[float]) -> str:
    return ",".join("NaN" if x != x else f"{x:.12g}" for x in q)


def write_mot(motion: Motion, path: Path) -> list[Path]:
    """Write joint angles in degrees as coordinates of a Rajagopal-type model.

    An instant at which one of them is not known is left out: OpenSim's Storage, which most of its tools read
    with, ends without a word at the first cell that is no number. Raises TableError where none is left.
    """
    angles = coordinates_deg(motion)
    if not angles:
        raise TableError("a .mot holds joint angles; leave --columns out, or add theta and clinical")
    block = np.stack([motion.time_s, *angles.values()], axis=-1)
    whole = np.asarray(np.isfinite(block).all(axis=1))
    least = min(angles, key=lambda name: int(np.isfinite(angles[name]).sum()))
    left_out = f"{int((~whole).sum())} of {len(whole)} instants, most for {least}"
    if not whole.any():
        raise TableError(
            f"a .mot holds instants at which every coordinate is known, and there is none, most for {least}; "
            "name those that are wanted with --columns"
        )
    if not whole.all():
        _log.warning("left out %s: a .mot cannot say that a number is not known; see --columns", left_out)
    head = [
        "Coordinates",
        "version=1",
        f"nRows={int(whole.sum())}",
        f"nColumns={block.shape[1]}",
        "inDegrees=yes",
        f"{KEY}={one_line(motion.about | ({} if whole.all() else {'left_out': left_out}))}",
        "endheader",
    ]
    return _write(path, head, ["time", *angles], [[repr(x) for x in row] for row in block[whole].tolist()])


def coordinates_deg(motion: Motion) -> dict[str, Floats]:
    """Return the model's coordinates (n,) deg by name; those whose angles are not there are left out."""
    found: dict[str, Floats] = {}
    trunk = motion.trunk_deg
    if "trunk_flexion" in trunk:
        found["lumbar_extension"] = -trunk["trunk_flexion"]
    for ours, theirs in (("trunk_lateral", "lumbar_bending"), ("trunk_rotation", "lumbar_rotation")):
        if ours in trunk:
            found[theirs] = trunk[ours]
    for arm in motion.arms.values():
        found |= {name + suffix(arm.side): values for name, values in _arm_deg(arm).items()}
    return {name: values for name, values in found.items() if np.isfinite(values).any()}


def _arm_deg(arm: ArmPath) -> dict[str, Floats]:
    angles = arm.angles_deg
    names = {
        "theta1": "arm_flex",
        "theta2": "arm_add",
        "theta3": "arm_rot",
        "elbow_flexion": "elbow_flex",
        "forearm_pronation": "pro_sup",
    }
    found = {theirs: angles[ours] for ours, theirs in names.items() if ours in angles}
    if "pro_sup" in found:
        found["pro_sup"] = found["pro_sup"] + 90.0  # theirs is 0 with the palm forward
    if "wrist_flexion" in angles and "wrist_deviation" in angles:
        flexion, deviation = isb_wrist_deg(angles["wrist_flexion"], angles["wrist_deviation"])
        found |= {"wrist_flex": flexion, "wrist_dev": deviation}
    return found


def write_trc(motion: Motion, path: Path) -> list[Path]:
    """Write joint centres as markers, mm, X forward, Y up, Z to the right, from the chest.

    Raises TableError when there are none.
    """
    places = joint_centres_mm(motion)
    if not places:
        raise TableError("a .trc holds positions, and there are none; leave --columns out or add positions")
    n, k, rate = len(motion.time_s), len(places), f"{motion.rate_hz:.9g}"
    names = "\t\t\t".join(places)
    lines = [
        f"PathFileType\t4\t(X/Y/Z)\t{path.name}",
        "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\tOrigNumFrames",
        f"{rate}\t{rate}\t{n}\t{k}\tmm\t{rate}\t1\t{n}",
        f"Frame#\tTime\t{names}\t\t\t",
        "\t\t" + "\t".join(f"{axis}{i}" for i in range(1, k + 1) for axis in "XYZ") + "\t",
        "",
    ]
    block = np.concatenate(list(places.values()), axis=1)
    for i, (time_s, row) in enumerate(zip(motion.time_s.tolist(), block.tolist(), strict=True), start=1):
        # The tab at the end lets OpenSim see that a last marker is missing.
        cells = "\t".join("" if x != x else f"{x:.4f}" for x in row)
        lines.append(f"{i}\t{time_s!r}\t{cells}\t")
    path.write_text("\n".join(lines) + "\n", encoding="utf-8", newline="\n")
    return [path, write_sidecar(path, motion.about | {"frames": MARKER_FRAMES})]


MARKER_FRAMES = "the thorax's axes, X forward, Y up, Z to the right, from the chest; mm"


def joint_centres_mm(motion: Motion) -> dict[str, Floats]:
    """Return joint centres (n, 3) mm by `elbow_r`: thorax axes, from the chest."""
    return {
        joint + suffix(arm.side): MM_PER_M * thorax_from_trunk(arm.positions_m[joint])
        for arm in motion.arms.values()
        for joint in JOINTS
        if joint in arm.positions_m
    }


def _write(path: Path, head: list[str], labels: list[str], rows: list[list[str]]) -> list[Path]:
    lines = [*head, "\t".join(labels), *("\t".join(row) for row in rows)]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8", newline="\n")
    return [path]
