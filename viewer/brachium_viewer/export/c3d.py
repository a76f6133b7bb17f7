"""C3D, as gait laboratories' tools read it: joint centres as points, joint angles as analogue channels."""

import errno
from pathlib import Path
from typing import Any

import numpy as np

from brachium_body.angles import TRUNK
from brachium_body.segments import suffix
from brachium_viewer.export.about import CHUNK, KEY, one_line
from brachium_viewer.export.motion import Motion
from brachium_viewer.export.opensim import MARKER_FRAMES, joint_centres_mm
from brachium_wire.table import TableError

MOST_FRAMES = 65_535
"""Frames are counted with 16 bits; readers part ways beyond."""


def write_c3d(motion: Motion, path: Path) -> list[Path]:
    """Write points in mm and angles in deg; a point that is not known has residual -1.

    Raises TableError without positions, or for more frames than the format counts, OSError.
    """
    import ezc3d

    places, angles = joint_centres_mm(motion), angles_deg(motion)
    if not places:
        raise TableError("a C3D file holds positions, and there are none; leave --columns out")
    n = len(motion.time_s)
    if n > MOST_FRAMES:
        raise TableError(f"a C3D file holds {MOST_FRAMES} frames, not {n}; cut with --from and --until")
    points = np.ones((4, len(places), n))
    for i, block in enumerate(places.values()):
        points[:3, i] = block.T
    unknown = np.isnan(points[:3]).any(axis=0)
    points[:3, unknown] = np.nan  # ezc3d writes residual -1 there
    made = ezc3d.c3d()
    made["parameters"]["POINT"]["RATE"]["value"] = [motion.rate_hz]
    made["parameters"]["POINT"]["LABELS"]["value"] = list(places)
    made["parameters"]["POINT"]["UNITS"]["value"] = ["mm"]
    made["parameters"]["ANALOG"]["RATE"]["value"] = [motion.rate_hz]
    made["parameters"]["ANALOG"]["LABELS"]["value"] = list(angles)
    made["parameters"]["ANALOG"]["UNITS"]["value"] = ["deg"] * len(angles)
    made.add_parameter("POINT", "X_SCREEN", ["+X"])
    made.add_parameter("POINT", "Y_SCREEN", ["+Y"])
    text = one_line(motion.about | {"frames": MARKER_FRAMES})
    chunks = [text[i : i + CHUNK] for i in range(0, len(text), CHUNK)]
    made.add_parameter(KEY.upper(), "ABOUT", chunks)
    if motion.events:
        _add_events(made, motion.events)
    made["data"]["points"] = points
    made["data"]["meta_points"]["residuals"] = np.where(unknown, -1.0, 0.0)[None]
    made["data"]["analogs"] = np.stack(list(angles.values()))[None] if angles else np.zeros((1, 0, n))
    made.write(str(path))
    _check_whole(path, n * 4 * (4 * len(places) + len(angles)))
    return [path]


def _check_whole(path: Path, data_bytes: int) -> None:
    """Raise OSError when the file ends before its data does: ezc3d does not tell what it could not write."""
    with path.open("rb") as file:
        begins = 512 * (int.from_bytes(file.read(18)[16:], "little") - 1)
    if begins <= 0 or path.stat().st_size < begins + data_bytes:
        raise OSError(errno.EIO, "not written whole; is the disk full?", str(path))


def _add_events(made: Any, events: list[dict[str, Any]]) -> None:
    """Add what was marked, as laboratories' tools show it above the time line."""
    seconds = [float(event["time_s"]) for event in events]
    made.add_parameter("EVENT", "USED", [len(events)])
    made.add_parameter("EVENT", "CONTEXTS", ["General"] * len(events))
    made.add_parameter("EVENT", "LABELS", [str(event["kind"]) for event in events])
    made.add_parameter("EVENT", "DESCRIPTIONS", [str(event["text"])[:CHUNK] for event in events])
    # Minutes and seconds, one column an event.
    made.add_parameter("EVENT", "TIMES", np.array([[0.0] * len(events), seconds]))


def angles_deg(motion: Motion) -> dict[str, np.ndarray]:
    """Return every angle (n,) deg of every arm by its name with `_r` or `_l`; the trunk's has no ending.

    Those that are never known are left out.
    """
    found = dict(motion.trunk_deg)
    for arm in motion.arms.values():
        found |= {name + suffix(arm.side): v for name, v in arm.angles_deg.items() if name not in TRUNK}
    return {name: values for name, values in found.items() if np.isfinite(values).any()}
