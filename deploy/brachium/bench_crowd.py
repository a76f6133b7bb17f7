"""Many arms at once, straight to the bus: one wearer's samples, made before, under many subjects.

python -m brachium.bench_crowd ENDPOINT ROOM ARMS SECONDS
"""

import sys
from collections.abc import Iterator

import msgspec
import numpy as np

from brachium.shell import print_json, stop_on_signals
from brachium_body.segments import Segment
from brachium_nodes.wearer import Wearer, WearerSettings
from brachium_wire import keys
from brachium_wire.bus import Bus
from brachium_wire.codec import encode
from brachium_wire.hosttime import HostClock
from brachium_wire.messages import Info, SampleBatch, Session
from brachium_wire.samples import write_samples

HOST = "crowd"
BATCH = 5
RATE_HZ = 100.0
PERIOD_NS = 10_000_000
BATCH_NS = BATCH * PERIOD_NS
GROUPS = 10
"""Subjects send in this many groups, spread over the time of one batch."""
LEAD_NS = 500_000_000


def main(endpoint: str, room: str, arms: int, seconds: float) -> None:
    """Send, then print how many samples were sent and how late the sender itself was at most."""
    stop, clock = stop_on_signals(), HostClock()
    wearer = Wearer(WearerSettings(level="ideal", seed=1, batch=BATCH))
    late_ns, sent = 0, 0
    with Bus.open(endpoint, stop=stop) as bus:
        for name in subjects(arms):
            bus.retain(keys.session(room, name), encode(Session(height_m=1.8, facing_deg=0.0)))
            for segment in wearer.segments:
                bus.retain(keys.info(room, name, segment), encode(_info(wearer, name, segment)))
        made = {segment: _batches(wearer, segment, seconds) for segment in wearer.segments}
        start_ns = clock.now_ns() + LEAD_NS
        for due_ns, names in _turns(subjects(arms), seconds):
            if stop.wait(max(0.0, (start_ns + due_ns - clock.now_ns()) * 1e-9)):
                break
            late_ns = max(late_ns, clock.now_ns() - start_ns - due_ns)
            for segment, batches in made.items():
                batch = batches[due_ns // BATCH_NS - 1]
                shifted = msgspec.structs.replace(
                    batch, time_ns=batch.time_ns + start_ns + due_ns % BATCH_NS, received_ns=clock.now_ns()
                )
                payload = encode(shifted)
                for name in names:
                    bus.put(keys.imu(room, name, segment), payload)
                    sent += BATCH
        stop.wait(0.5)  # what is on its way still arrives
    print_json({"samples_sent": sent, "late_ms": late_ns * 1e-6})


def subjects(arms: int) -> list[str]:
    """Return the subjects' names."""
    return [f"p{number:03d}" for number in range(arms)]


def _info(wearer: Wearer, name: str, segment: Segment) -> Info:
    sensor = wearer.info(segment)
    return Info(
        node=f"{name}-{segment}",
        rate_hz=sensor.rate_hz,
        origin="emulated",
        host=HOST,
        mounting=sensor.mounting,
        calibration=sensor.calibration,
        magnetometer=sensor.magnetometer,
    )


def _turns(names: list[str], seconds: float) -> Iterator[tuple[int, list[str]]]:
    """Yield when which subjects send, ns from the start: all once a batch, in groups one after the other."""
    for number in range(1, round(seconds * 1e9 / BATCH_NS) + 1):
        for group in range(GROUPS):
            yield number * BATCH_NS + group * BATCH_NS // GROUPS, names[group::GROUPS]


def _batches(wearer: Wearer, segment: Segment, seconds: float) -> list[SampleBatch]:
    """Return one sensor's batches with times from 0."""
    readings = wearer.samples(segment, 0, round(seconds * RATE_HZ))
    batches = []
    for first in range(0, len(readings.acc), BATCH):
        rows = slice(first, first + BATCH)
        times = PERIOD_NS * np.arange(first, first + BATCH)
        batches.append(
            write_samples(
                sequence=first,
                time_ns=times,
                device_us=times // 1000,
                received_ns=1,
                uncertainty_ns=1000,
                acc=readings.acc[rows],
                gyr=readings.gyr[rows],
                mag=readings.mag[rows],
            )
        )
    return batches


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], int(sys.argv[3]), float(sys.argv[4]))
