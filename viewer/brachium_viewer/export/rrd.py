"""`.rrd`, to look at in Rerun: the live view's own pictures. No archive: only the same version opens it."""

from pathlib import Path

import numpy as np

from brachium_body import rotation
from brachium_body.kinematics import TRUNK_FROM_THORAX
from brachium_body.segments import Side, arm_segments
from brachium_viewer.drawings import Arm, Drawing, Layout, Text
from brachium_viewer.export.about import write_sidecar
from brachium_viewer.export.motion import Motion
from brachium_viewer.panel import NOT_A_DEVICE
from brachium_viewer.scene import PLOTS, draw_body, draw_skeleton
from brachium_wire.messages import SegmentPose, Skeleton

STANDING = (1.0, 0.0, 0.0, 0.0)


def write_rrd(motion: Motion, path: Path) -> list[Path]:
    """Write the pictures; needs Rerun, of the version that will open the file."""
    import rerun as rr

    from brachium_viewer.screen import APPLICATION, Pen

    subject = str(motion.about.get("subject") or "p01")
    recording = rr.RecordingStream(APPLICATION, recording_id=path.stem)
    recording.save(path)
    pen = Pen(recording)
    arms = tuple(Arm(subject, side, False) for side in motion.arms)
    angles = {name for arm in motion.arms.values() for name in arm.angles_deg}
    shown = tuple(plot.angle for plot in PLOTS if plot.angle in angles)
    words = f"Origin: {motion.about['origin']}. {NOT_A_DEVICE}"
    first = float(motion.time_s[0])
    pen.write({"layout": (first, Layout(arms, shown, subject)), "words": (first, Text(words))})
    for row, time_s in enumerate(motion.time_s.tolist()):
        drawings: dict[str, Drawing] = {}
        for side in motion.arms:
            skeleton = skeleton_at(motion, side, row)
            drawings[f"world/{subject}/body"] = draw_body(skeleton, 0.0)
            drawings |= draw_skeleton(subject, skeleton, 0.0)
        pen.write({name: (time_s, drawing) for name, drawing in drawings.items()})
    recording.disconnect()
    return [path, write_sidecar(path, motion.about)]


def skeleton_at(motion: Motion, side: Side, row: int) -> Skeleton:
    """Return one arm at one instant as the view draws it; what is not known is not in it."""
    arm = motion.arms[side]
    trunk = rotation.multiply(TRUNK_FROM_THORAX, rotation.inverse(motion.world_from_thorax[row]))
    segments: dict[str, SegmentPose] = {}
    for segment in arm_segments(side):
        words = motion.table.columns.get(f"quality_{segment}")
        if words is not None and words[row]:
            segments[segment] = SegmentPose(quality=words[row])
    return Skeleton(
        time_ns=round(1e9 * float(motion.time_s[row])),
        side=side,
        origin="emulated" if motion.about["origin"] == "emulated" else "playback",
        forward="none",
        trunk_from_world=tuple(trunk.tolist()) if np.isfinite(trunk).all() else STANDING,
        segments=segments,
        positions={
            n: tuple(p[row].tolist()) for n, p in arm.positions_m.items() if np.isfinite(p[row]).all()
        },
        angles={n: float(np.radians(v[row])) for n, v in arm.angles_deg.items() if np.isfinite(v[row])},
    )
