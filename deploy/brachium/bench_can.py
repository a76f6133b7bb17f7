"""What CAN sensors cost, and whether frames of two samples ever meet."""

import random
import statistics
import tempfile
import time
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

from brachium import bench_can_faults
from brachium.bench_can_faults import FaultReport
from brachium.bench_run import helpers, pid, shares
from brachium.can_traffic import GROUP, STEP_IDS
from brachium.checks import free_port
from brachium.processes import Processes
from brachium.shell import Failed
from brachium_nodes.can.grouping import Grouper, Key, Sample
from brachium_wire import keys
from brachium_wire.bus import Bus, Inbox
from brachium_wire.codec import decode
from brachium_wire.messages import Health

ROOM = "can-load"
SEGMENTS = ("upper_arm_r", "forearm_r", "hand_r")
START_S = 20.0
PERIOD_NS = 10_000_000
NAMES = ("acc", "gyr", "mag")


@dataclass(frozen=True, kw_only=True)
class LoadFigures:
    """Sensors on one bus, their samples decoded and put on the network."""

    sensors: int
    frames_per_s: float
    """That came in."""
    samples_per_s: float
    """That went out."""
    samples_off: float
    """Share by which these are not what the sensors took."""
    cpu: float
    """Of one core, `brachium can`: median of five windows."""
    bare_cpu: float
    """Of one core, a loop of python-can's recv and nothing else, on the same frames at the same time."""


@dataclass(frozen=True, kw_only=True)
class MixingFigures:
    """Frames that were lost, doubled, late, and between those of others."""

    samples: int
    """That were sent, half with a counter in every frame, half with a time before them."""
    given: int
    mixed: int
    """Of those given, with a member of another sample."""
    out_of_order: int
    incomplete: int
    late_members: int


def measure(what: str, window_s: float) -> LoadFigures | MixingFigures | FaultReport:
    """Measure one of `load`, `mixing`, `faults`."""
    if what == "load":
        return load(window_s)
    return mixing() if what == "mixing" else bench_can_faults.measure()


def load(window_s: float = 4.0, sensors: int = 12, rate_hz: int = 100) -> LoadFigures:
    """Measure `brachium can` on the load of some sensors with a field."""
    router, channel = free_port(), free_port()
    endpoint = f"tcp/127.0.0.1:{router}"
    with tempfile.TemporaryDirectory() as name, Processes() as services, helpers() as others:
        folder = Path(name)
        table = folder / "sensors.toml"
        table.write_text(_table(folder, sensors, rate_hz))
        network = ["--room", ROOM, "--endpoint", endpoint]
        port = ["--interface", "udp_multicast", "--channel", GROUP, "--port", str(channel)]
        services.start("router", ["router", "--room", ROOM, "--port", str(router)], stderr=folder / "router")
        reader = services.start("can", ["can", *network, *port, "--in", str(table)], stderr=folder / "can")
        bare = others.start("bare", ["brachium.can_traffic", str(channel)])
        with Bus.open(endpoint, timeout_s=20.0) as bus:
            inbox = bus.subscribe(keys.services(ROOM, "can/can"))
            if not inbox.wait(20.0):
                raise Failed(f"no brachium can: {reader.complaint()}")
            sending = [str(channel), "--send", str(sensors), str(rate_hz)]
            others.start("sensors", ["brachium.can_traffic", *sending])
            first = _flowing(inbox)
            used = shares([pid(reader), pid(bare)], window_s)
            inbox.wait(5.0)
            last = decode(inbox.drain()[-1][1], Health)
    span_s = 1e-9 * (last.time_ns - first.time_ns)
    frames = (last.counts["frames_in"] - first.counts["frames_in"]) / span_s
    samples = (last.counts["samples"] - first.counts["samples"]) / span_s
    return LoadFigures(
        sensors=sensors,
        frames_per_s=frames,
        samples_per_s=samples,
        samples_off=abs(samples / (sensors * rate_hz) - 1.0),
        cpu=statistics.median(used[0]),
        bare_cpu=statistics.median(used[1]),
    )


def _flowing(inbox: Inbox) -> Health:
    """Return the first health that tells of samples, a second after they began."""
    deadline, told = time.monotonic() + START_S, 0
    while time.monotonic() < deadline:
        inbox.wait(0.5)
        for _, payload in inbox.drain():
            health = decode(payload, Health)
            told += "samples" in health.counts
            if told == 2:
                return health
    raise Failed(f"no samples came in within {START_S:.0f} s")


def _table(folder: Path, sensors: int, rate_hz: int) -> str:
    """Write MTi-600 with ids of 29 bits; return a table of them."""
    from brachium_nodes.can.map_files import SHIPPED

    dbc = (SHIPPED / "mti-600.dbc").read_text()
    for number in (5, 6, 33, 50, 52, 65):  # bit 31 of a DBC's id: 29 bits
        dbc = dbc.replace(f"_ {number} ", f"_ {number | 1 << 31} ")
    (folder / "extended.dbc").write_text(dbc)
    return "".join(
        f'[[sensor]]\nid = "mti-{n}"\nmap = "mti-600"\ndbc = "extended.dbc"\nadd_to_ids = {STEP_IDS * n}\n'
        f"rate_hz = {rate_hz}.0\n"
        f'subject = "p{n // 3:02d}"\nsegment = "{SEGMENTS[n % 3]}"\n\n'
        for n in range(sensors)
    )


def mixing(samples: int = 100_000, seed: int = 1) -> MixingFigures:
    """Disturb the frames of many samples, and look for one whose members are of two."""
    chance, given = random.Random(seed), list[Sample]()
    counted = Grouper(Key(1.0, 256.0, PERIOD_NS), frozenset(NAMES[:2]), frozenset(NAMES[2:]), keyed=True)
    timed = Grouper(Key(100.0, 2.0**32, PERIOD_NS), frozenset(NAMES[:2]), frozenset(NAMES[2:]), keyed=False)
    half = samples // 2
    frames = list[tuple[int, int, str]]()
    for number in range(half):
        for place, name in enumerate(NAMES):
            for _ in range(chance.choice((1, 1, 1, 1, 1, 1, 0, 2))):
                late = chance.choice((0, 0, 0, 0, 0, 0, 3, 12, 45, 70, 300)) * 1_000_000
                frames.append((number * PERIOD_NS + place * 100_000 + late, number, name))
    ordered = out_of_order = 0
    for at_ns, number, name in sorted(frames):
        given += counted.tick(at_ns)
        given += counted.member(name, (float(number),), at_ns, float(number % 256))
    mixed, out_of_order = _looked_at(given)
    ordered = len(given)
    given = []
    for number in range(half):
        for place, name in enumerate(("time", *NAMES)):
            at_ns = number * PERIOD_NS + place * 100_000
            for _ in range(chance.choice((1, 1, 1, 1, 1, 1, 0, 2))):
                given += timed.tick(at_ns)
                if name == "time":
                    given += timed.key(float((2**32 - 100_000 + 100 * number) % 2**32), at_ns)
                else:
                    given += timed.member(name, (float(number),), at_ns)
    again, disorder = _looked_at(given)
    drops = counted.drops + timed.drops
    return MixingFigures(
        samples=2 * half,
        given=ordered + len(given),
        mixed=mixed + again,
        out_of_order=out_of_order + disorder,
        incomplete=drops["incomplete"],
        late_members=drops["late_member"],
    )


def _looked_at(given: list[Sample]) -> tuple[int, int]:
    """Return how many samples are of two, and how many stand before an older one."""
    mixed = sum(len(set(sample.members.values())) != 1 for sample in given)
    disorder = sum(b.ticks <= a.ticks for a, b in pairwise(given))
    return mixed, disorder
