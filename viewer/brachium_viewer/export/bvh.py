"""BVH, as animation programs read it: trunk and arms. Y up, Z forward, X to the subject's left; cm."""

from pathlib import Path
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from brachium_body import rotation
from brachium_viewer.export.about import write_sidecar
from brachium_viewer.export.frames import thorax_from_trunk, zxy_deg
from brachium_viewer.export.motion import ArmPath, Motion
from brachium_wire.table import TableError

Floats = npt.NDArray[np.float64]

CM_PER_M = 100.0
BVH_FROM_THORAX = rotation.about(1, -np.pi / 2.0)
"""X forward, Y up, Z right to Z forward, Y up, X left."""
STEADY_MM = 1.0
"""Bones whose measured lengths vary by more are no bones: the session's lengths were changed."""
FRAMES = "Y up, Z forward, X to the subject's left; cm; angles Z, X, Y about moving axes; root at the chest"


class Bone(NamedTuple):
    """A joint of the file: where it is in its parent (cm), how it turns (n, 3) deg, how it shifts (n, 3)."""

    name: str
    offset: Floats
    turn_deg: Floats
    shift: Floats | None
    end: Floats | None
    """Where the last bone ends, cm."""


def write_bvh(motion: Motion, path: Path) -> list[Path]:
    """Write the motion; where something is not known it stands as it stood, and the file beside names when.

    Raises TableError without positions or joint angles, or when lengths changed on the way.
    """
    held: dict[str, list[list[int]]] = {}
    ground = rotation.multiply(motion.ground_from_world, motion.world_from_thorax)
    upright = np.where(np.isnan(ground).all(), rotation.IDENTITY, ground)
    root = Bone("trunk", np.zeros(3), _angles("trunk", upright, held), np.zeros((len(ground), 3)), None)
    arms = [_arm(arm, held) for arm in motion.arms.values()]
    lines = ["HIERARCHY", *_head("ROOT", root, 0)]
    for bones in arms:
        for depth, bone in enumerate(bones, start=1):
            lines += _head("JOINT", bone, depth)
        end = bones[-1].end
        lines += [*_end(end, len(bones) + 1), *("\t" * d + "}" for d in range(len(bones), 0, -1))]
    lines += ["}", "MOTION", f"Frames: {len(ground)}", f"Frame Time: {1.0 / motion.rate_hz:.9f}"]
    blocks = []
    for bone in [root, *(bone for bones in arms for bone in bones)]:
        blocks += [] if bone.shift is None else [bone.shift]
        blocks.append(bone.turn_deg)
    rows = np.concatenate(blocks, axis=1)
    lines += [" ".join(f"{x:.6f}" for x in row) for row in rows.tolist()]
    path.write_text("\n".join(lines) + "\n", encoding="ascii", newline="\n")
    return [path, write_sidecar(path, motion.about | {"frames": FRAMES, "held": held})]


def _arm(arm: ArmPath, held: dict[str, list[list[int]]]) -> list[Bone]:
    end, joints = arm.side[0], arm.joints
    chest, *lengths = _lengths(arm)
    outwards = np.array([0.0, 0.0, chest if arm.side == "right" else -chest])
    still = np.zeros((len(joints.thorax_from_upper_arm), 3))
    # Where the shoulder is, and not the column of its shift: positions carry it, and come back by and by.
    shift = thorax_from_trunk(arm.positions_m["shoulder"]) - outwards
    moved = _filled(f"shoulder_{end}", _bvh(shift), held)
    down = [np.array([0.0, -length, 0.0]) for length in (0.0, *lengths)]
    names = [f"{part}_{end}" for part in ("upper_arm", "forearm", "hand")]
    bones = [Bone(f"shoulder_{end}", _bvh(outwards), still, None, None)]
    for i, (name, q) in enumerate(zip(names, joints, strict=True)):
        last = _bvh(down[3]) if i == 2 else None
        bones.append(Bone(name, _bvh(down[i]), _angles(name, q, held), moved if i == 0 else None, last))
    return bones


def _lengths(arm: ArmPath) -> list[float]:
    """Return chest to shoulder, upper arm, forearm and hand (m) as they stand in the positions."""
    places = arm.positions_m
    if not {"shoulder", "elbow", "wrist", "hand"} <= places.keys():
        raise TableError("a BVH file needs positions of all joints; leave --columns out")
    shift = np.nan_to_num(arm.shoulder_shift_m[:, 0])
    found = [np.abs(places["shoulder"][:, 0] - shift)]
    for near, far in (("shoulder", "elbow"), ("elbow", "wrist"), ("wrist", "hand")):
        found.append(np.linalg.norm(places[far] - places[near], axis=1))
    known = [lengths[np.isfinite(lengths)] for lengths in found]
    if not all(map(len, known)):
        raise TableError(f"a BVH file needs positions of all joints; the {arm.side} arm has not all of them")
    for name, lengths in zip(("upper arm", "forearm", "hand"), known[1:], strict=True):
        if 1000.0 * np.ptp(lengths) > STEADY_MM:
            raise TableError(
                f"the {arm.side} {name} is {lengths.min():.3f} to {lengths.max():.3f} m long: its length was "
                "changed on the way; cut with --from and --until"
            )
    return [float(np.median(lengths)) for lengths in known]


def _bvh(places_m: Floats) -> Floats:
    return CM_PER_M * rotation.rotate(BVH_FROM_THORAX, places_m)


def _angles(name: str, q: Floats, held: dict[str, list[list[int]]]) -> Floats:
    """Return the angles (n, 3) deg of turns (n, 4) given in the thorax's axes, in the file's."""
    turned = rotation.multiply(rotation.multiply(BVH_FROM_THORAX, q), rotation.inverse(BVH_FROM_THORAX))
    return _filled(name, zxy_deg(np.broadcast_to(turned, q.shape)), held)


def _filled(name: str, block: Floats, held: dict[str, list[list[int]]]) -> Floats:
    """Return a block (n, k) in which unknown rows repeat the last known one, the first ones the first known.

    `held` takes the first and last frame of each such run, counted from 0.
    """
    known = np.isfinite(block).all(axis=1)
    if known.all():
        return block
    if not known.any():
        raise TableError(f"a BVH file needs joint angles, and {name} has none; leave --columns out")
    edges = np.flatnonzero(np.diff(np.concatenate([[0], (~known).astype(np.int8), [0]])))
    runs = [[int(a), int(b) - 1] for a, b in zip(edges[::2], edges[1::2], strict=True)]
    held[name] = runs
    rows = np.maximum.accumulate(np.where(known, np.arange(len(block)), -1))
    rows[rows < 0] = int(np.argmax(known))
    return block[rows]


def _head(kind: str, bone: Bone, depth: int) -> list[str]:
    tabs = "\t" * depth
    place = "Xposition Yposition Zposition " if bone.shift is not None else ""
    return [
        f"{tabs}{kind} {bone.name}",
        f"{tabs}{{",
        f"{tabs}\tOFFSET {_numbers(bone.offset)}",
        f"{tabs}\tCHANNELS {6 if place else 3} {place}Zrotation Xrotation Yrotation",
    ]


def _end(place: Floats | None, depth: int) -> list[str]:
    tabs = "\t" * depth
    assert place is not None
    return [f"{tabs}End Site", f"{tabs}{{", f"{tabs}\tOFFSET {_numbers(place)}", f"{tabs}}}"]


def _numbers(values: Floats) -> str:
    return " ".join(f"{x + 0.0:.6f}" for x in values.tolist())
