"""Two arms and six sensors on the bus at their usual rates, at next to no cost: for what only looks."""

import threading
import time
from typing import Self

import numpy as np

from brachium_body.segments import SEGMENTS, SIDES, Side, arm_segments, side_of
from brachium_wire import keys
from brachium_wire.bus import Bus
from brachium_wire.codec import encode
from brachium_wire.messages import Info, SegmentPose, Skeleton
from brachium_wire.samples import write_samples

ROOM, SUBJECT = "bench", "p01"
RATE_HZ = 50.0
EVERY = 5
"""Skeletons a batch of a sensor, of 10 samples each at 100 Hz."""


class SkeletonSource:
    """Publishes from a thread while it is entered; each skeleton's time is the moment it is published."""

    def __init__(self, bus: Bus) -> None:
        self._bus, self._stop = bus, threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._sensors = [segment for segment in SEGMENTS if side_of(segment) is not None]

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stop.set()
        self._thread.join(5.0)

    def _run(self) -> None:
        for segment in self._sensors:
            info = Info(node=f"bench-{segment}", rate_hz=100.0, origin="emulated", host="bench")
            self._bus.retain(keys.info(ROOM, SUBJECT, segment), encode(info))
        number, due = 0, time.monotonic()
        while not self._stop.wait(max(0.0, due - time.monotonic())):
            due += 1.0 / RATE_HZ
            for side in SIDES:
                skeleton = moving_arm(side, number / RATE_HZ, time.time_ns())
                self._bus.put(keys.skeleton(ROOM, SUBJECT, side), encode(skeleton))
            if number % EVERY == 0:
                self._batches(10 * (number // EVERY))
            number += 1

    def _batches(self, first: int) -> None:
        now_ns = time.time_ns()
        for segment in self._sensors:
            batch = write_samples(
                sequence=first,
                time_ns=now_ns + 10_000_000 * np.arange(10),
                device_us=10_000 * (first + np.arange(10)),
                received_ns=now_ns,
                uncertainty_ns=0,
                acc=np.tile([0.0, 0.0, 9.81], (10, 1)),
                gyr=np.zeros((10, 3)),
            )
            self._bus.put(keys.imu(ROOM, SUBJECT, segment), encode(batch))


def moving_arm(side: Side, seconds: float, time_ns: int) -> Skeleton:
    """Return the skeleton of an arm that bends and straightens its elbow."""
    elbow = np.radians(60.0 + 50.0 * np.sin(1.5 * seconds))
    x = 0.23 if side == "right" else -0.23
    points = np.array([[x, 0.0, 0.0], [x, 0.0, -0.33], [x, 0.0, 0.0], [x, 0.0, 0.0]])
    way = np.array([0.0, np.sin(elbow), -np.cos(elbow)])
    points[2], points[3] = points[1] + 0.26 * way, points[1] + 0.45 * way
    names = ("shoulder", "elbow", "wrist", "hand")
    return Skeleton(
        time_ns=time_ns,
        side=side,
        origin="emulated",
        forward="facing",
        trunk_from_world=(1.0, 0.0, 0.0, 0.0),
        segments={name: SegmentPose(quality="good") for name in arm_segments(side)},
        positions={n: (float(p[0]), float(p[1]), float(p[2])) for n, p in zip(names, points, strict=True)},
        angles={
            "elbow_flexion": float(elbow),
            **dict.fromkeys(
                (
                    "shoulder_flexion",
                    "shoulder_abduction",
                    "shoulder_rotation",
                    "forearm_pronation",
                    "wrist_flexion",
                    "wrist_deviation",
                    "isb_elevation",
                ),
                0.0,
            ),
        },
    )
