"""Exported C3D, BVH and Rerun files through Kinetics Toolkit, bvhio and Rerun."""

import json
import math
import warnings
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from brachium.export_readers.found import Found, trunk_axes


def read_c3d(path: Path) -> Found:
    """Read with Kinetics Toolkit."""
    import kineticstoolkit

    found = kineticstoolkit.read_c3d(str(path), convert_point_unit=False)
    points, analogs = found["Points"], found["Analogs"]
    return Found(
        reader=f"Kinetics Toolkit {version('kineticstoolkit')}",
        time_s=points.time,
        angles_deg=dict(analogs.data),
        places_mm={name: trunk_axes(values[:, :3]) for name, values in points.data.items()},
    )


def read_bvh(path: Path) -> Found:
    """Read with bvhio: every frame's hierarchy, and where its joints come to be."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # bvhio imports PyGLM by a name that PyGLM will give up
        import bvhio
        from pyglm import glm

    root, text = bvhio.readAsHierarchy(str(path)), bvhio.readAsBvh(str(path))
    joints = {joint.Name: joint for joint, _, _ in root.layout()}
    ends = {bone.Name: bone.EndSite for bone, _, _ in text.Root.layout()}
    # At rest bvhio's own axes lie along the bones: what is fixed to a bone is found there.
    root.loadRestPose()
    level = root.RotationWorldInverse
    kept: dict[str, tuple[Any, Any, list[list[float]]]] = {}
    for bone, joint in joints.items():
        part, _, end = bone.rpartition("_")
        if part in BONES:
            kept[f"{BONES[part]}_{end}"] = (joint, joint.pointToLocal(joint.PositionWorld), [])
        if part == "hand":
            kept[bone] = (joint, joint.pointToLocal(joint.PositionWorld + ends[bone]), [])
    for frame in range(text.FrameCount):
        root.loadPose(frame)
        turn = root.RotationWorld * level
        for joint, fixed, places in kept.values():
            places.append(list(glm.inverse(turn) * (joint.pointToWorld(fixed) - root.PositionWorld)))
    found = {name: 10.0 * np.array(places) for name, (_, _, places) in kept.items()}
    said = json.loads(path.with_name(path.name + ".json").read_text(encoding="utf-8"))
    return Found(
        reader="bvhio",
        time_s=np.arange(text.FrameCount, dtype=np.float64) * text.FrameTime,
        # X to the left, Y up, Z forward, cm
        places_mm={name: np.stack([-p[:, 0], p[:, 2], p[:, 1]], axis=1) for name, p in found.items()},
        held=said["held"],
    )


BONES = {"upper_arm": "shoulder", "forearm": "elbow", "hand": "wrist"}
"""Which joint each bone begins at."""


def read_rrd(path: Path) -> Found:
    """Read with Rerun: the drawn lines' values and the drawn bones' ends."""
    from rerun.chunk import RrdReader

    angles: dict[str, dict[float, float]] = {}
    bones: dict[str, dict[float, list[list[float]]]] = {}
    for chunk in RrdReader(path).stream():
        batch, parts = chunk.to_record_batch(), str(chunk.entity_path).strip("/").split("/")
        if "time" not in batch.schema.names:
            continue
        times = [t.total_seconds() for t in batch.column("time").to_pylist()]
        if parts[0] == "angles" and "Scalars:scalars" in batch.schema.names:
            name = f"{parts[1]}_{parts[-1].rpartition('_')[2][0]}"
            values = batch.column("Scalars:scalars").to_pylist()
            angles.setdefault(name, {}).update({t: v[0] for t, v in zip(times, values, strict=True) if v})
        elif parts[0] == "world" and parts[-1] in ("right", "left"):
            column = batch.column("Capsules3D:translations").to_pylist()
            bones.setdefault(parts[-1][0], {}).update(dict(zip(times, column, strict=True)))
    grid = np.array(sorted({t for rows in bones.values() for t in rows}))
    return Found(
        reader="Rerun",
        time_s=grid,
        angles_deg={
            n: np.array([rows.get(t, math.nan) for t in grid.tolist()]) for n, rows in angles.items()
        },
        places_mm={
            f"{joint}_{end}": np.array([_start(rows.get(t), i) for t in grid.tolist()])
            for end, rows in bones.items()
            for i, joint in enumerate(("shoulder", "elbow", "wrist"))
        },
    )


CHEST_M = 1.38
"""How high the view draws the chest."""


def _start(rows: list[list[float]] | None, bone: int) -> list[float]:
    """Return where a bone begins, mm from the chest: of each bone and its joint, the bone is drawn first."""
    if not rows or len(rows) <= 2 * bone:
        return [math.nan] * 3
    x, y, z = rows[2 * bone]
    return [1000.0 * x, 1000.0 * y, 1000.0 * (z - CHEST_M)]
