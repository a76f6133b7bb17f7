"""Exported files of OpenSim through OpenSim; frames are turned back by scipy."""

from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from brachium.export_readers.found import Floats, Found, trunk_axes


def read_sto(path: Path) -> Found:
    """Read with OpenSim; joint angles come from the bodies' orientations against one another."""
    import opensim

    table = opensim.TimeSeriesTableQuaternion(str(path))
    labels, rows = list(table.getColumnLabels()), range(table.getNumRows())
    cells = np.array(
        [
            [[table.getRowAtIndex(i).getElt(0, j).get(k) for k in range(4)] for j in range(len(labels))]
            for i in rows
        ]
    )
    turns = {label.removesuffix("_imu"): cells[:, j] for j, label in enumerate(labels)}
    angles: dict[str, Floats] = {}
    for end in ("r", "l"):
        shoulder = _zxy(turns.get("torso"), turns.get(f"humerus_{end}"), end)
        elbow = _zxy(turns.get(f"humerus_{end}"), turns.get(f"radius_{end}"), end)
        wrist = _zxy(turns.get(f"radius_{end}"), turns.get(f"hand_{end}"), end)
        for names, found in (
            (("theta1", "theta2", "theta3"), shoulder),
            (("isb_elbow_flexion", "isb_carrying", "isb_pronation"), elbow),
            (("wrist_flex", "wrist_dev", ""), wrist),
        ):
            angles |= {f"{n}_{end}": found[:, i] for i, n in enumerate(names) if n and found is not None}
    times = np.array(list(table.getIndependentColumn()))
    return Found(reader=f"OpenSim {opensim.GetVersion()}", time_s=times, angles_deg=angles)


def _zxy(parent: Floats | None, child: Floats | None, end: str) -> Floats | None:
    """Return the angles (n, 3) deg about Z, X, Y of a child (n, 4) in its parent, left arms mirrored."""
    if parent is None or child is None:
        return None
    known = np.isfinite(parent).all(axis=1) & np.isfinite(child).all(axis=1)
    out = np.full((len(parent), 3), np.nan)
    a, b = (Rotation.from_quat(q[known], scalar_first=True) for q in (parent, child))
    out[known] = (a.inv() * b).as_euler("ZXY", degrees=True) * ([1, 1, 1] if end == "r" else [1, -1, -1])
    return out


def read_mot(path: Path) -> Found:
    """Read with both of OpenSim's readers. Raises ValueError where one of them finds less."""
    import opensim

    opensim.Logger.setLevelString("error")  # Storage tells of each file on standard output
    table = opensim.TimeSeriesTable(str(path))
    stored = opensim.Storage(str(path)).getSize()
    if stored != table.getNumRows():
        raise ValueError(f"{path}: OpenSim's Storage reads {stored} of {table.getNumRows()} rows")
    matrix = table.getMatrix()
    cells = np.array(matrix.to_numpy())
    if table.getTableMetaDataString("inDegrees") != "yes":
        raise ValueError(f"{path}: is not in degrees")
    return Found(
        reader=f"OpenSim {opensim.GetVersion()}",
        time_s=np.array(list(table.getIndependentColumn())),
        angles_deg=_our_angles({label: cells[:, i] for i, label in enumerate(table.getColumnLabels())}),
        whole_instants=True,
    )


def _our_angles(model: dict[str, Floats]) -> dict[str, Floats]:
    """Return the model's coordinates (n,) deg as our angles: its wrist bends first and deviates then."""
    found: dict[str, Floats] = {}
    for end in (end for end in ("r", "l") if f"arm_flex_{end}" in model):
        names = {
            "arm_flex": "theta1",
            "arm_add": "theta2",
            "arm_rot": "theta3",
            "elbow_flex": "elbow_flexion",
        }
        for theirs, ours in names.items():
            found[f"{ours}_{end}"] = model[f"{theirs}_{end}"]
        found[f"forearm_pronation_{end}"] = model[f"pro_sup_{end}"] - 90.0
        if f"wrist_flex_{end}" in model:
            a, b = (np.radians(model[f"wrist_{name}_{end}"]) for name in ("flex", "dev"))
            found[f"wrist_flexion_{end}"] = np.degrees(np.arcsin(np.sin(a) * np.cos(b)))
            found[f"wrist_deviation_{end}"] = np.degrees(np.arctan2(np.sin(b), np.cos(a) * np.cos(b)))
    return found


def read_trc(path: Path) -> Found:
    """Read with OpenSim."""
    import opensim

    table = opensim.TimeSeriesTableVec3(str(path))
    flat = table.flatten()
    matrix = flat.getMatrix()
    cells = np.array(matrix.to_numpy()).reshape(table.getNumRows(), -1, 3)
    return Found(
        reader=f"OpenSim {opensim.GetVersion()}",
        time_s=np.array(list(table.getIndependentColumn())),
        places_mm={label: trunk_axes(cells[:, i]) for i, label in enumerate(table.getColumnLabels())},
    )
