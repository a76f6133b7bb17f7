"""Motion-BIDS: one recording more in the folder of a study. Names are the subjects' pseudonyms."""

import csv
import json
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from brachium_body.kinematics import JOINTS
from brachium_body.segments import SEGMENTS, suffix
from brachium_viewer.export.about import KEY
from brachium_viewer.export.c3d import angles_deg
from brachium_viewer.export.motion import Motion
from brachium_viewer.export.rows import PARTS
from brachium_viewer.panel import NOT_A_DEVICE
from brachium_wire.table import TableError

Floats = npt.NDArray[np.float64]

BIDS_VERSION = "1.10.0"
SYSTEM = "imu"
UNKNOWN = "n/a"


@dataclass(frozen=True, kw_only=True)
class Channel:
    """One column of a recording, as channels.tsv tells of it."""

    name: str
    component: str
    type: str
    tracked_point: str
    units: str
    reference_frame: str
    values: Floats


def write_motion_bids(motion: Motion, folder: Path) -> list[Path]:
    """Add the motion to a study's folder, made where there is none.

    `about` names subject, session and task. Raises TableError for a recording that is there already.
    """
    subject = _label(motion.about.get("subject") or "p01", "subject")
    export = motion.about.get("export", {})
    session = _label(export.get("session", ""), "session", empty=True)
    task = _label(export.get("task") or "movement", "task")
    parts = [f"sub-{subject}", *([f"ses-{session}"] if session else [])]
    where = folder.joinpath(*parts, "motion")
    stem = "_".join([*parts, f"task-{task}", f"tracksys-{SYSTEM}"])
    tsv = where / f"{stem}_motion.tsv"
    if tsv.exists():
        raise TableError(f"{tsv}: is there already; give another --session or --task")
    where.mkdir(parents=True, exist_ok=True)
    found = channels(motion)
    heads = ("name", "component", "type", "tracked_point", "units", "reference_frame")
    _write_tsv(where / f"{stem}_channels.tsv", [heads, *([getattr(c, h) for h in heads] for c in found)])
    _write_json(where / f"{stem}_channels.json", FRAMES)
    _write_json(where / f"{stem}_motion.json", _described(motion, task, found))
    if motion.events:
        _write_tsv(where / f"{stem.replace(f'_tracksys-{SYSTEM}', '')}_events.tsv", _events(motion))
    study = _study(folder, subject, motion)
    # Last: only a recording whose numbers are there is there already.
    block = np.stack([channel.values for channel in found], axis=-1)
    _write_tsv(tsv, ([_cell(x) for x in row] for row in block.tolist()))
    return [*study, tsv]


def _events(motion: Motion) -> list[list[str]]:
    """Return what was marked, each an instant without length."""
    rows = [["onset", "duration", "trial_type", "text"]]
    for event in motion.events:
        rows.append([f"{event['time_s']:.6f}", "0", str(event["kind"]), _plain(event["text"])])
    return rows


def _plain(text: str) -> str:
    """Return a text as one cell can hold it."""
    return " ".join(str(text).split()) or UNKNOWN


def channels(motion: Motion) -> list[Channel]:
    """Return the columns: positions and angles of the arms, orientations of the segments."""
    found = []
    for arm in motion.arms.values():
        for joint in (j for j in JOINTS if j in arm.positions_m):
            point = joint + suffix(arm.side)
            for i, axis in enumerate("xyz"):
                values = arm.positions_m[joint][:, i]
                found.append(_channel(f"{point}_{axis}", axis, "POS", point, "m", "trunk", values))
    for name, values in angles_deg(motion).items():
        found.append(_channel(name, UNKNOWN, "JNTANG", name, "deg", UNKNOWN, values))
    for segment in (s for s in SEGMENTS if s in motion.world_from_segment):
        for i, part in enumerate(PARTS):
            values = motion.world_from_segment[segment][:, i]
            found.append(
                _channel(f"{segment}_q{part}", f"quat_{part}", "ORNT", segment, "1", "world", values)
            )
    return found


def _channel(
    name: str, component: str, kind: str, point: str, units: str, frame: str, values: Floats
) -> Channel:
    return Channel(
        name=name,
        component=component,
        type=kind,
        tracked_point=point,
        units=units,
        reference_frame=frame,
        values=values,
    )


FRAMES: dict[str, Any] = {
    "reference_frame": {
        "Description": "Axes in which positions and orientations are given.",
        "Levels": {
            "trunk": {
                "Description": "x to the subject's right, y forward, z up, from the chest",
                "RotationRule": "right-hand",
                "RotationOrder": "ZXY",
                "SpatialAxes": "RAS",
            },
            "world": {
                "Description": "z up; x east and y magnetic north where there is a magnetometer. "
                "Quaternions turn a segment's axes, X forward, Y proximal, Z to the subject's right with "
                "the arm hanging, into these",
                "RotationRule": "right-hand",
                "RotationOrder": UNKNOWN,
                "SpatialAxes": "RAS",
            },
        },
    }
}


def _described(motion: Motion, task: str, found: list[Channel]) -> dict[str, Any]:
    counts = {kind: sum(c.type == kind for c in found) for kind in ("POS", "JNTANG", "ORNT")}
    return {
        "TaskName": task,
        "TaskDescription": f"Origin: {motion.about['origin']}. {NOT_A_DEVICE}",
        "SamplingFrequency": round(motion.rate_hz, 9),
        "SamplingFrequencyEffective": round(motion.rate_hz, 9),
        "TrackingSystemName": SYSTEM,
        "RecordingType": "continuous",
        "RecordingDuration": round(float(motion.time_s[-1] - motion.time_s[0]), 6),
        "MissingValues": UNKNOWN,
        "MotionChannelCount": len(found),
        "TrackedPointsCount": len({c.tracked_point for c in found}),
        "SoftwareVersions": str(motion.about["made_by"]),
        **{f"{kind}ChannelCount": n for kind, n in counts.items()},
        KEY: motion.about,
    }


def _study(folder: Path, subject: str, motion: Motion) -> list[Path]:
    """Write or complete what a study's folder holds beside its recordings."""
    description = folder / "dataset_description.json"
    if not description.exists():
        made = {"Name": "Brachium", "Version": str(motion.about["made_by"]), "Description": NOT_A_DEVICE}
        _write_json(
            description,
            {
                "Name": folder.resolve().name,
                "BIDSVersion": BIDS_VERSION,
                "DatasetType": "raw",
                "GeneratedBy": [made],
            },
        )
    readme = folder / "README.md"
    if not readme.exists():
        readme.write_text(README, encoding="utf-8")
    people = folder / "participants.tsv"
    rows = [["participant_id", "origin"]]
    if people.exists():
        with people.open(encoding="utf-8", newline="") as file:
            rows = list(csv.reader(file, delimiter="\t"))
    if f"sub-{subject}" not in [row[0] for row in rows]:
        known = {"participant_id": f"sub-{subject}", "origin": str(motion.about["origin"])}
        _write_tsv(people, [*rows, [known.get(head, UNKNOWN) for head in rows[0]]])
    explained = folder / "participants.json"
    if not explained.exists():
        _write_json(explained, {"origin": {"Description": "worn by a person, emulated, or a playback"}})
    return [description, readme, people, explained]


README = f"""# A study of arm movements

Recorded with inertial sensors. {NOT_A_DEVICE}
Participants go by pseudonyms; `origin` in participants.tsv says whether a person wore the sensors. Every
`*_motion.json` holds below `{KEY}` how its numbers were made. Positions are of joint centres in the
trunk's axes, angles in degrees; a number that is not known is `n/a`.
"""


def _label(text: object, what: str, *, empty: bool = False) -> str:
    """Return a name as BIDS allows it: letters and digits alone."""
    label = "".join(c for c in str(text) if c.isascii() and c.isalnum())
    if not label and not (empty and not text):
        raise TableError(f"{what} {text!r}: a name in BIDS has letters and digits")
    return label


def _cell(value: float) -> str:
    return UNKNOWN if value != value else repr(value)


def _write_tsv(path: Path, rows: Iterable[Iterable[str]]) -> None:
    _write(path, "".join("\t".join(row) + "\n" for row in rows))


def _write_json(path: Path, content: dict[str, Any]) -> None:
    _write(path, json.dumps(content, indent=2, allow_nan=False) + "\n")


def _write(path: Path, text: str) -> None:
    """Write a file whole or not at all: a full disk takes nobody from the list of participants."""
    fresh = path.with_name(f".{path.name}.new")
    try:
        fresh.write_text(text, encoding="utf-8", newline="\n")
        fresh.replace(path)
    except OSError:
        fresh.unlink(missing_ok=True)
        raise
