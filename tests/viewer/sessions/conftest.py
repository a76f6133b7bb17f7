"""Recordings of sessions with marks, quick to write: skeletons whose elbow and shoulder move as asked."""

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from brachium_viewer import marks
from brachium_wire import keys, recording
from brachium_wire.codec import encode
from brachium_wire.messages import Calibration, Info, Origin, SegmentPose, Session, Skeleton, Status

T0 = 1_700_000_000_000_000_000
RATE_HZ = 50


def skeleton(subject_side: str, t_s: float, elbow_deg: float, origin: Origin, **more: Any) -> Skeleton:
    ending = subject_side[0]
    sign = 1.0 if subject_side == "right" else -1.0
    bend = np.radians(elbow_deg)
    wrist = (sign * 0.2, 0.25 * float(np.sin(bend)), -0.3 - 0.25 * float(np.cos(bend)))
    named: dict[str, Any] = {
        "time_ns": T0 + round(t_s * 1e9),
        "side": subject_side,
        "origin": origin,
        "forward": "elbow",
        "trunk_from_world": (1.0, 0.0, 0.0, 0.0),
        "segments": {f"{s}_{ending}": SegmentPose(quality="good") for s in ("upper_arm", "forearm")},
        "positions": {
            "shoulder": (sign * 0.2, 0.0, 0.0),
            "elbow": (sign * 0.2, 0.0, -0.3),
            "wrist": wrist,
            "hand": (wrist[0], 1.5 * wrist[1], wrist[2]),
        },
        "angles": {
            "elbow_flexion": float(bend),
            "isb_elevation": 0.05,
            "isb_plane": 0.0,
            "forearm_pronation": 0.1 * float(bend),
            "shoulder_flexion": 0.02 * float(bend),
        },
        "shoulder_shift": (0.0, 0.01 * float(np.sin(bend)), 0.0),
        **more,
    }
    return Skeleton(**named)


def elbow_deg(t_s: float, top_deg: float, base_deg: float = 10.0) -> float:
    """Return an elbow that bends and straightens every four seconds."""
    return base_deg + (top_deg - base_deg) * float(np.sin(np.pi * t_s / 4.0) ** 2)


class Script:
    """A session: sets of elbow flexion one after the other, and what was marked between."""

    def __init__(self, subject: str = "p01", origin: Origin = "worn") -> None:
        self.subject, self.origin = subject, origin
        self.messages: list[tuple[float, str, bytes]] = []
        self.now_s = 4.0
        for segment in ("upper_arm_r", "forearm_r"):
            info = Info(node=f"n-{segment}", rate_hz=100.0, origin=origin, host="h", chip="mpu9150")
            self.messages.append((0.0, keys.info("gym", subject, segment), encode(info)))
        done = Calibration(
            time_ns=T0, state="done", pose="n-pose", forward="elbow", warnings=["heading drifts"]
        )
        self.messages.append((0.0, keys.calibration("gym", subject), encode(done)))
        said = Session(side="right", height_m=1.8)
        self.messages.append((0.0, keys.session("gym", subject), encode(said)))

    def mark(self, mark: marks.Mark, text: str = "") -> None:
        event = marks.event(mark, T0 + round(self.now_s * 1e9), text)
        self.messages.append((self.now_s, keys.event("gym", self.subject), encode(event)))

    def move(self, repetitions: int, top_deg: float, side: str = "right", **more: Any) -> None:
        for i in range(repetitions * 4 * RATE_HZ):
            t = self.now_s + i / RATE_HZ
            one = skeleton(side, t, elbow_deg(i / RATE_HZ, top_deg), self.origin, **more)
            self.messages.append((t, keys.skeleton("gym", self.subject, side), encode(one)))
        self.now_s += repetitions * 4.0

    def set(self, count: int, top_deg: float, side: Any = "right", **begins: Any) -> None:
        self.mark(marks.ExerciseBegins(exercise="elbow-flexion", side=side, **begins))
        self.move(count, top_deg, side)
        self.mark(marks.ExerciseEnds())
        self.now_s += 1.0

    def status(self, lost: int = 7) -> None:
        for segment in ("upper_arm_r", "forearm_r"):
            status = Status(
                node="n",
                time_ns=T0 + round(self.now_s * 1e9),
                connected=True,
                received=1000,
                lost=lost,
                out_of_order=0,
                battery_level=0.62,
            )
            self.messages.append((self.now_s, keys.status("gym", self.subject, segment), encode(status)))


def write(path: Path, scripts: Iterable[Script]) -> Path:
    everything = sorted(
        (message for script in scripts for message in script.messages), key=lambda one: one[0]
    )
    with recording.RecordingWriter(path, {"started": "2026-01-02T03:04:05+00:00"}) as writer:
        for t_s, key, payload in everything:
            writer.write(key, payload, T0 + round(t_s * 1e9))
    return path


@pytest.fixture(scope="session")
def script() -> type[Script]:
    return Script


@pytest.fixture(scope="session")
def write_session() -> Callable[[Path, Iterable[Script]], Path]:
    return write
