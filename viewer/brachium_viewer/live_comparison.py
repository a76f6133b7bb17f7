"""Two subjects of a running network, a person's own nodes and a second set of sensors, compared live."""

import logging
import time
from collections import Counter
from dataclasses import dataclass, field
from threading import Event

import numpy as np

from brachium_body.segments import SIDES, Side, side_of
from brachium_viewer.arm_track import track
from brachium_viewer.clock_offset import Rates, Unrelated
from brachium_viewer.two_sensors import TwoSensors, two_sensors
from brachium_wire import keys
from brachium_wire.bus import DEFAULT_ENDPOINT, Bus
from brachium_wire.codec import WireError, decode_topic
from brachium_wire.hosttime import NoHostTime, follow_host_time
from brachium_wire.messages import Info, SampleBatch, Session, Skeleton
from brachium_wire.samples import read_samples

log = logging.getLogger(__name__)

LOOK_S = 0.2
SETTLE_S = 0.7
"""After the end, so that the later one's samples of the last instants have come."""


@dataclass(frozen=True, kw_only=True)
class LiveSettings:
    """Who is compared, and for how long."""

    a: str
    """The reference: errors are b - a."""
    b: str
    endpoint: str = DEFAULT_ENDPOINT
    room: str = keys.DEFAULT_ROOM
    seconds: float | None = None
    """Of movement that both have measured and solved; None: until stopped."""


@dataclass(frozen=True, kw_only=True)
class Hosts:
    """What the clocks are said to be, apart from what the movement shows."""

    apart_s: float | None
    """Host time of b less that of a at one moment; None when one of them does not tell it."""
    margin_s: float | None
    stated_s: dict[str, float]
    """Half widths within which each subject's sample times are said to lie: their median."""


@dataclass(frozen=True, kw_only=True)
class LiveComparison:
    """What was found."""

    a: str
    b: str
    exercise: str
    origin: str
    """Of a's skeletons: what was not worn by a person is no measurement of one."""
    chips: dict[str, str]
    side: Side
    hosts: Hosts
    found: TwoSensors
    drops: dict[str, int]
    """Messages that could not be used, by reason."""


@dataclass(slots=True)
class _Subject:
    """What was heard of one subject."""

    skeletons: dict[Side, list[Skeleton]] = field(default_factory=lambda: {side: [] for side in SIDES})
    truth: dict[Side, list[Skeleton]] = field(default_factory=lambda: {side: [] for side in SIDES})
    batches: dict[str, list[SampleBatch]] = field(default_factory=dict)
    infos: dict[str, Info] = field(default_factory=dict)
    exercise: str = ""
    uncertainties_ns: list[int] = field(default_factory=list)


class _Listener:
    def __init__(self, bus: Bus, settings: LiveSettings) -> None:
        self.subjects = {name: _Subject() for name in (settings.a, settings.b)}
        self.drops: Counter[str] = Counter()
        tails = ("imu/**", "skeleton/*", "truth/*", "session")
        self._inboxes = [
            bus.subscribe(keys.subjects(settings.room, tail, name), 65536)
            for name in self.subjects
            for tail in tails
        ]
        for name in self.subjects:
            for tail in ("imu/*/info", "session"):
                self._hear_all(bus.fetch(keys.subjects(settings.room, tail, name)))

    def drain(self) -> None:
        for inbox in self._inboxes:
            self._hear_all(inbox.drain())
        self.drops["overflow"] = sum(inbox.dropped for inbox in self._inboxes)

    def solved(self) -> int:
        """Return how many skeletons the subject that has fewer has got."""
        return min(max(len(s) for s in heard.skeletons.values()) for heard in self.subjects.values())

    def _hear_all(self, messages: list[tuple[str, bytes]]) -> None:
        for key, payload in messages:
            try:
                parsed = keys.parse(key)
                self._hear(self.subjects[parsed.subject], parsed, decode_topic(payload, parsed.topic))
            except keys.BadKey:
                self.drops["bad_key"] += 1
            except WireError as error:
                self.drops[error.drop.value] += 1

    def _hear(self, heard: _Subject, key: keys.Key, message: object) -> None:
        if isinstance(message, Info):
            heard.infos[key.detail] = message
        elif isinstance(message, Session):
            heard.exercise = message.exercise
        elif isinstance(message, SampleBatch):
            heard.uncertainties_ns.append(message.uncertainty_ns)
            heard.batches.setdefault(key.detail, []).append(message)
        elif isinstance(message, Skeleton):
            (heard.truth if key.topic == "truth" else heard.skeletons)[message.side].append(message)


def run(settings: LiveSettings, stop: Event) -> LiveComparison:
    """Listen for `seconds` or until `stop`, then compare. Raises Unrelated or NoRouter, of one line each."""
    with Bus.open(settings.endpoint, stop=stop) as bus:
        listener = _Listener(bus, settings)
        begun: float | None = None
        while not stop.wait(LOOK_S):
            listener.drain()
            if begun is None and listener.solved():
                begun = time.monotonic()
                log.info("both are there; press Ctrl-C when the exercise is done")
            if begun is not None and settings.seconds and time.monotonic() - begun > settings.seconds:
                break
        time.sleep(SETTLE_S)
        listener.drain()
        hosts = _hosts(bus, settings, listener)
    return _compared(settings, listener, hosts)


def _compared(settings: LiveSettings, listener: _Listener, hosts: Hosts) -> LiveComparison:
    a, b = (listener.subjects[name] for name in (settings.a, settings.b))
    for name, heard in listener.subjects.items():
        if not any(heard.skeletons.values()):
            known = "its sensors are" if heard.infos else "no sensor of it is"
            raise Unrelated(f"{name}: no skeleton came; {known} there: start its sensors and brachium fuse")
    side = max(SIDES, key=lambda s: min(len(a.skeletons[s]), len(b.skeletons[s])))
    origin_ns = a.skeletons[side][0].time_ns if a.skeletons[side] else 0
    rates = {
        s: (_rates(a, s, origin_ns), _rates(b, s, origin_ns))
        for s in a.batches
        if s in b.batches and side_of(s) == side and s in a.infos and s in b.infos
    }
    found = two_sensors(
        track(a.skeletons[side], origin_ns),
        track(b.skeletons[side], origin_ns),
        rates,
        side,
        track(a.truth[side], origin_ns, truth=True) if a.truth[side] else None,
    )
    return LiveComparison(
        a=settings.a,
        b=settings.b,
        exercise=a.exercise,
        origin=a.skeletons[side][-1].origin,
        chips={name: heard.infos[found.segment].chip for name, heard in listener.subjects.items()},
        side=side,
        hosts=hosts,
        found=found,
        drops={reason: count for reason, count in listener.drops.items() if count},
    )


def _rates(heard: _Subject, segment: str, origin_ns: int) -> Rates:
    """Return a sensor's calibrated angular rates in order of time."""
    bias = heard.infos[segment].calibration.gyro_bias or (0.0, 0.0, 0.0)
    times, rates = [np.empty(0)], [np.empty((0, 3))]
    for batch in heard.batches[segment]:
        samples = read_samples(batch)
        if samples.gyr is not None and not samples.late:
            times.append(1e-9 * (np.array(samples.time_ns) - origin_ns))
            rates.append(samples.gyr - np.array(bias))
    time_s, first = np.unique(np.concatenate(times), return_index=True)
    return Rates(time_s, np.concatenate(rates)[first])


def _hosts(bus: Bus, settings: LiveSettings, listener: _Listener) -> Hosts:
    stated = {
        name: 1e-9 * float(np.median(heard.uncertainties_ns or [0]))
        for name, heard in listener.subjects.items()
    }
    names = [next(iter(h.infos.values())).host for h in listener.subjects.values() if h.infos]
    try:
        if len(names) < 2:
            raise NoHostTime("a sensor is missing")
        a, b = (follow_host_time(bus, settings.room, name) for name in names)
    except NoHostTime as error:
        log.warning("%s", error)
        return Hosts(apart_s=None, margin_s=None, stated_s=stated)
    return Hosts(
        apart_s=1e-9 * (b.at(0) - a.at(0)),
        margin_s=1e-9 * (a.uncertainty_ns + b.uncertainty_ns),
        stated_s=stated,
    )
