"""A therapist's session as a recording, made faster than real time: an emulated wearer, the pipeline, marks.

Each part is emulated and solved by itself, its calibration first, as `solve` does it; the parts then stand
one after the other in one file with their samples, skeletons and marks, as a recorder would have put them.
"""

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory

import msgspec
import numpy as np
import numpy.typing as npt

from brachium.evaluation.emulated import Emulated
from brachium.evaluation.loss import kept
from brachium.evaluation.solving import solved
from brachium.evaluation.trials import GUIDED, Trial
from brachium_body.segments import Side
from brachium_fusion import capture_batches
from brachium_nodes.sensors import Level
from brachium_viewer import marks
from brachium_wire import keys, recording
from brachium_wire.codec import encode
from brachium_wire.messages import Calibration, Info, Message, Session, Skeleton, Status
from brachium_wire.samples import write_samples

ROOM, SUBJECT = "emulated", "p01"
ZERO_NS = 1_790_000_000_000_000_000
BATCH = 5
LOSS = 0.01
SET_SHARE = 0.85
"""Of the time between one set's begin and the next one's; then the therapist lets the patient rest."""
ARRIVES_NS = 30_000_000
"""After the last sample that it needs, a skeleton is recorded."""


@dataclass(frozen=True, kw_only=True)
class Part:
    """One exercise: what the wearer does, what the therapist chose, and the modes of its sets."""

    moves: str
    exercise: str
    side: Side = "right"
    modes: tuple[marks.Mode, ...] = ("active", "active", "active")
    goal_deg: float | None = None


PLAN: tuple[Part, ...] = (
    Part(
        moves="elbow-flexion", exercise="elbow-flexion", modes=("active", "active", "passive"), goal_deg=80.0
    ),
    Part(moves="elbow-flexion", exercise="elbow-flexion", side="left", goal_deg=80.0),
    Part(moves="shoulder-abduction", exercise="shoulder-abduction", goal_deg=75.0),
    Part(moves="wrist-flexion", exercise="wrist-flexion", goal_deg=45.0),
    Part(moves="drinking", exercise="drinking"),
)

Rows = npt.NDArray[np.int64]
Timed = tuple[int, str, Message]
"""When it arrives, its key, and what it is."""


def write(path: Path, minutes: float = 20.0, seed: int = 1, level: Level = "typical") -> int:
    """Write the recording and return its skeletons; raises FileExistsError when there is one."""
    messages: list[Timed] = [(ZERO_NS, keys.session(ROOM, SUBJECT), Session(side="both", height_m=1.8))]
    begin, sent = ZERO_NS, dict[str, Counter[str]]()
    for part in PLAN:
        length_s = 60.0 * minutes / len(PLAN)
        messages += _part(part, begin, length_s, seed, level, sent)
        begin += round(length_s * 1e9)
    messages += _asked("before", ZERO_NS + 2_000_000_000, 3, 2) + _asked("after", begin - 2_000_000_000, 3, 5)
    messages.sort(key=lambda one: one[0])
    with recording.RecordingWriter(path, {"room": ROOM, "started": "2026-09-21T14:13:20+00:00"}) as writer:
        for at, key, message in messages:
            writer.write(key, encode(message), at)
    return sum(isinstance(message, Skeleton) for _, _, message in messages)


def _asked(when: marks.When, at: int, pain: int, effort: int) -> list[Timed]:
    key = keys.event(ROOM, SUBJECT)
    asked = (marks.Pain(value=pain, when=when), marks.Effort(value=effort, when=when))
    return [(at, key, marks.event(mark, at)) for mark in asked]


def _part(
    part: Part, begin_ns: int, length_s: float, seed: int, level: Level, sent: dict[str, Counter[str]]
) -> Iterator[Timed]:
    """Yield one exercise's messages, in no order; `sent` counts each sensor's samples from part to part."""
    trial = Trial(exercise=part.moves, level=level, seed=seed, side=part.side, routine=GUIDED, loss=LOSS,
                  burst=BATCH, parts=("upper_arm", "forearm", "hand"))  # fmt: skip
    begins_s = Emulated(trial).begin_s
    if length_s - begins_s < 10.0:
        raise ValueError(f"an exercise of {length_s:.0f} s is over before its calibration; give more minutes")
    made = Emulated(replace(trial, seconds=length_s - begins_s))
    skeletons = _solved(made)
    for skeleton in skeletons:
        at = begin_ns + skeleton.time_ns - capture_batches.ZERO_NS
        moved = msgspec.structs.replace(skeleton, time_ns=at, origin="emulated")
        yield at + ARRIVES_NS, keys.skeleton(ROOM, SUBJECT, part.side), moved
    yield from _sensors(made, begin_ns, sent)
    yield from _marks(part, begin_ns, begins_s, length_s)
    done = Calibration(
        time_ns=begin_ns, state="done", pose="n-pose", forward=skeletons[-1].forward, progress=1.0
    )
    yield begin_ns + round(begins_s * 1e9), keys.calibration(ROOM, SUBJECT), done


def _solved(made: Emulated) -> list[Skeleton]:
    with TemporaryDirectory() as folder:
        made.write(Path(folder) / "capture")
        return solved(Path(folder) / "capture", "auto").skeletons


def _marks(part: Part, begin_ns: int, begins_s: float, length_s: float) -> Iterator[Timed]:
    """Yield a set for each mode, with a rest after it."""
    slot_s = (length_s - begins_s) / len(part.modes)
    for i, mode in enumerate(part.modes):
        begins = marks.ExerciseBegins(
            exercise=part.exercise,
            side=part.side,
            mode=mode,
            goal_deg=part.goal_deg,
            set=i + 1,
            sets=len(part.modes),
            repetitions=10,
        )
        for mark, share in ((begins, 0.0), (marks.ExerciseEnds(), SET_SHARE)):
            at = begin_ns + round((begins_s + (i + share) * slot_s) * 1e9)
            yield at, keys.event(ROOM, SUBJECT), marks.event(mark, at)


def _sensors(made: Emulated, begin_ns: int, sent: dict[str, Counter[str]]) -> Iterator[Timed]:
    """Yield what the sensors sent: their info, batches, and status once a second."""
    trial, time_s = made.trial, made.session.time_s
    at = begin_ns + np.round(time_s * 1e9).astype(np.int64)
    for segment, sensor in made.sensors().items():
        if segment not in sent:
            info = Info(node=f"n-{segment}", rate_hz=trial.rate_hz, origin="emulated", host="emulated",
                        chip="mpu9150", magnetometer=True)  # fmt: skip
            yield begin_ns, keys.info(ROOM, SUBJECT, segment), info
        before = sent.setdefault(segment, Counter())
        there = kept(len(time_s), trial.loss, trial.burst, f"{trial.seed}/{segment}")
        for rows in _batches(np.flatnonzero(there)):
            batch = write_samples(
                sequence=int(rows[0]) + before.total(),
                time_ns=at[rows],
                device_us=at[rows] // 1000 - ZERO_NS // 1000,
                received_ns=int(at[rows[-1]]) + ARRIVES_NS // 2,
                uncertainty_ns=1_000_000,
                acc=sensor.acc[rows],
                gyr=sensor.gyr[rows],
                mag=sensor.mag[rows],
            )
            yield int(at[rows[-1]]) + ARRIVES_NS // 2, keys.imu(ROOM, SUBJECT, segment), batch
        rate = round(trial.rate_hz)
        for end in range(rate, len(time_s), rate):
            status = Status(
                node=f"n-{segment}",
                time_ns=int(at[end]),
                connected=True,
                received=before["kept"] + int(there[:end].sum()),
                lost=before["lost"] + int((~there[:end]).sum()),
                out_of_order=0,
                battery_level=0.9 - 2e-6 * (before.total() + end),
            )
            yield int(at[end]), keys.status(ROOM, SUBJECT, segment), status
        before.update(kept=int(there.sum()), lost=int((~there).sum()))


def _batches(rows: Rows) -> Iterator[Rows]:
    """Yield runs of following rows, at most BATCH at a time."""
    for run in np.split(rows, np.flatnonzero(np.diff(rows) > 1) + 1):
        yield from (run[i : i + BATCH] for i in range(0, len(run), BATCH))
