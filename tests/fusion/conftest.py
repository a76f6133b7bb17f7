"""Batches, arms in known poses and a recording of them, for every test of fusion."""

from types import SimpleNamespace

import numpy as np
import pytest

from brachium_body import rotation
from brachium_body.kinematics import joint_orientations
from brachium_body.segments import SIDES, arm_segments
from brachium_wire import keys
from brachium_wire.codec import encode
from brachium_wire.messages import Info
from brachium_wire.samples import Samples, write_samples

START = 1_700_000_000_000_000_000
"""Host time of sample 0, ns: a multiple of every period used here."""
RATE = 100.0


def sample_times(first: int, n: int, rate: float = RATE) -> list[int]:
    """Return the host times of n samples from number `first` on."""
    return [START + round(1e9 * (first + i) / rate) for i in range(n)]


def samples(first: int, *, n: int | None = None, times=None, rate=RATE, **blocks) -> Samples:
    """Return a batch as it stands behind the door: `acc`, `gyr`, `mag`, `quat` as arrays."""
    arrays = {
        k: np.asarray(v, dtype=np.float64) for k, v in blocks.items() if k in ("acc", "gyr", "mag", "quat")
    }
    n = n or len(next(iter(arrays.values())))
    times = sample_times(first, n, rate) if times is None else list(times)
    return Samples(
        sequence=first,
        time_ns=times,
        device_us=0,
        device_offsets=b"",
        received_ns=blocks.get("received_ns", times[-1] + 1_000_000),
        uncertainty_ns=0,
        acc=arrays.get("acc"),
        gyr=arrays.get("gyr"),
        mag=arrays.get("mag"),
        mag_index=blocks.get("mag_index"),
        quat=arrays.get("quat"),
        late=blocks.get("late", False),
    )


def info(**more) -> Info:
    """Return an orientation-only sensor of an emulated wearer, as far as `more` does not say otherwise."""
    return Info(
        **{"node": "n", "rate_hz": RATE, "origin": "emulated", "host": "gw", "orientation_only": True} | more
    )


def arm_poses(theta, side="right", trunk_from_thorax=None) -> dict[str, np.ndarray]:
    """Return trunk_from_segment (n, 4) of an arm with model angles theta (n, 7) rad."""
    more = {} if trunk_from_thorax is None else {"trunk_from_thorax": trunk_from_thorax}
    return dict(zip(arm_segments(side), joint_orientations(theta, side, **more), strict=True))


def angle_paths(seconds: float, seed: int = 0, still_s: float = 3.6, rate: float = RATE) -> np.ndarray:
    """Return model angles (n, 7) rad: neutral for `still_s`, then every joint swings by its own."""
    random = np.random.default_rng(seed)
    t = np.arange(round(seconds * rate)) / rate - still_s
    size = np.radians([60.0, 35.0, 40.0, 50.0, 50.0, 20.0, 40.0])
    middle = np.radians([20.0, -10.0, 0.0, 55.0, 0.0, 0.0, 0.0])
    rise = np.clip(t / 2.0, 0.0, 1.0) ** 2 * (3.0 - 2.0 * np.clip(t / 2.0, 0.0, 1.0))
    swing = np.sin(2.0 * np.pi * random.uniform(0.1, 0.4, 7) * t[:, None] + random.uniform(0.0, 6.0, 7))
    return rise[:, None] * (middle + size * swing)


def random_rotation(random) -> np.ndarray:
    return rotation.normalize(random.normal(size=4))


def orientation_messages(
    segments: dict[str, np.ndarray], *, subject="p01", batch=5, latency_ns=4_000_000, rate=RATE
) -> list[tuple[keys.Key, bytes]]:
    """Return orientation-only batches of all segments (n, 4), world_from_sensor, by time of arrival."""
    arriving = []
    for order, (segment, quats) in enumerate(segments.items()):
        for first in range(0, len(quats), batch):
            block = quats[first : first + batch]
            times = sample_times(first, len(block), rate)
            arrival = times[-1] + latency_ns + 100_000 * order
            message = write_samples(
                sequence=first,
                time_ns=times,
                device_us=[(t - START) // 1000 for t in times],
                received_ns=arrival,
                uncertainty_ns=1000,
                quat=block,
            )
            arriving.append((arrival, keys.Key("room", subject, "imu", segment), encode(message)))
    return [(key, payload) for _, key, payload in sorted(arriving, key=lambda a: a[0])]


def info_messages(segments, subject="p01", **more) -> list[tuple[keys.Key, bytes]]:
    """Return one info a segment; `mounting` may be a map from segment to quaternion."""
    mountings = more.pop("mounting", {})
    result = []
    for segment in segments:
        mounting = mountings.get(segment)
        message = info(
            node=f"n-{segment}", mounting=None if mounting is None else tuple(map(float, mounting)), **more
        )
        result.append((keys.Key("room", subject, "info", segment), encode(message)))
    return result


@pytest.fixture(scope="session")
def made() -> SimpleNamespace:
    """What the tests of this folder build from."""
    return SimpleNamespace(
        START=START,
        RATE=RATE,
        SIDES=SIDES,
        sample_times=sample_times,
        samples=samples,
        info=info,
        arm_poses=arm_poses,
        angle_paths=angle_paths,
        random_rotation=random_rotation,
        orientation_messages=orientation_messages,
        info_messages=info_messages,
    )


def _wave(random, rms, slowest_hz, fastest_hz):
    """Return a smooth random function of time with this RMS."""
    hz, phase = random.uniform(slowest_hz, fastest_hz, 6), random.uniform(0.0, 2.0 * np.pi, 6)
    size = random.uniform(0.5, 1.0, 6)
    size *= rms * np.sqrt(2.0 / (size @ size))
    return lambda t: np.sin(2.0 * np.pi * np.multiply.outer(t, hz) + phase) @ size


class Pendulum:
    """Two sensors beside a joint of 1, 2 or 3 axes, swung at random: exact orientations, rates and forces."""

    lever_a, lever_b = np.array([0.12, 0.01, -0.015]), np.array([-0.15, 0.0, 0.02])
    axis_a = np.array([0.0, 0.0, 1.0])

    def __init__(self, axes, seconds, rate, seed, still_from_s=np.inf) -> None:
        random = np.random.default_rng(seed)
        self.axes, self.still_from_s = axes, still_from_s
        self.axis_b = np.array([0.0, 0.0, 1.0]) if axes == 1 else np.array([0.0, 1.0, 0.0])
        self._swing = [_wave(random, rms, 0.1, 1.1) for rms in (0.7, 0.6, 0.6, 0.7, 0.7, 0.6)]
        self._path = [_wave(random, 0.07, 0.3, 0.9) for _ in range(3)]
        t = np.arange(round(seconds * rate)) / rate
        self.world_from_a, self.world_from_b = self._orientations(t)
        self.gyr_a, self.acc_a = self._seen(t, 0, self.lever_a)
        self.gyr_b, self.acc_b = self._seen(t, 1, self.lever_b)

    def _own_time(self, t):
        """It comes to rest within two seconds."""
        u = np.clip(t - self.still_from_s, 0.0, 2.0) / 2.0
        return np.minimum(t, self.still_from_s) + 2.0 * (u - u**3 + u**4 / 2.0)

    def _orientations(self, t):
        s = [swing(self._own_time(t)) for swing in self._swing]
        a = rotation.multiply(rotation.about(2, s[0]), rotation.about(0, s[1]))
        a = rotation.multiply(a, rotation.about(1, s[2]))
        bend = rotation.about(2, s[3] + 0.8)
        if self.axes == 3:
            bend = rotation.multiply(bend, rotation.about(0, s[5]))
        if self.axes >= 2:
            bend = rotation.multiply(bend, rotation.about(1, s[4]))
        return a, rotation.multiply(a, bend)

    def _seen(self, t, sensor, lever, h=1e-3):
        def rate(t):
            before, after = self._orientations(t - h)[sensor], self._orientations(t + h)[sensor]
            return rotation.to_rotation_vector(rotation.multiply(rotation.inverse(before), after)) / (2.0 * h)

        def centre(t):
            return np.stack([path(self._own_time(t)) for path in self._path], axis=-1)

        force = (centre(t + h) - 2.0 * centre(t) + centre(t - h)) / h**2 + [0.0, 0.0, 9.80665]
        w = rate(t)
        inward = np.cross((rate(t + h) - rate(t - h)) / (2.0 * h), lever) + np.cross(w, np.cross(w, lever))
        return w, rotation.rotate(rotation.inverse(self._orientations(t)[sensor]), force) - inward


@pytest.fixture(scope="session")
def pendulum():
    """Return the maker of pendulums."""
    return Pendulum
