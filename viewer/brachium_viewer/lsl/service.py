"""The service: it follows a room, keeps a stream open for each thing in it, and brings markers back."""

import logging
import threading
import time
from dataclasses import dataclass
from types import ModuleType

from brachium_viewer.lsl import streams
from brachium_viewer.lsl.library import Markers, Outlet, Scope, load
from brachium_viewer.lsl.lsl_clock import LslClock, compare
from brachium_viewer.lsl.streams import Rows, Stream
from brachium_viewer.lsl.taps import TapWatch
from brachium_wire import keys
from brachium_wire.bus import DEFAULT_ENDPOINT, Bus
from brachium_wire.codec import Drop, WireError, decode_topic, encode
from brachium_wire.heart import Heart
from brachium_wire.hosttime import NoHostTime, follow_host_time
from brachium_wire.messages import Event, Info, SampleBatch, Skeleton
from brachium_wire.samples import read_samples
from brachium_wire.topics import TOPICS

log = logging.getLogger(__name__)

WAIT_S = 0.02
LOOK_S = 1.0
"""Between two looks for new marker streams, and two tries to learn a host's time."""
ANSWER_S = 2.0
"""Where nobody tells a host's time, that is known at once."""
MARKER = "marker"
"""Kind of the events that came from other LSL programs."""
TRIPLE_TAP = "triple_tap"


@dataclass(frozen=True, kw_only=True)
class LslSettings:
    """What of a room is streamed, and how far it is seen."""

    endpoint: str = DEFAULT_ENDPOINT
    room: str = keys.DEFAULT_ROOM
    subject: str | None = None
    """None: everybody in the room."""
    scope: Scope = "machine"
    id: str = "lsl"


def run(settings: LslSettings, stop: threading.Event) -> None:
    """Stream until `stop` is set. Raises NoLsl, ModuleNotFoundError, BadKey or NoRouter, each one line."""
    keys.service(settings.room, "lsl", settings.id)
    if settings.subject is not None:
        keys.subject_chunk(settings.subject)
    pylsl = load(settings.scope)
    with Bus.open(settings.endpoint, stop=stop) as bus:
        Service(bus, settings, pylsl).serve(stop)


class Service:
    """Joins bus and streams. It runs on one thread."""

    def __init__(self, bus: Bus, settings: LslSettings, pylsl: ModuleType) -> None:
        self._bus, self._settings, self._pylsl = bus, settings, pylsl
        self._outlets: dict[str, Outlet] = {}
        self._infos: dict[tuple[str, str], Info] = {}
        self._hosts: dict[str, str] = {}
        """By subject."""
        self._clocks: dict[str, LslClock] = {}
        self._asked_s: dict[str, float] = {}
        self._compared: set[str] = set()  # hosts, since a sensor of theirs was last told of
        self._taps: dict[tuple[str, str], TapWatch] = {}
        self._heart = Heart(bus, settings.room, "lsl", settings.id)

    def serve(self, stop: threading.Event) -> None:
        """Follow the room until `stop` is set."""
        room, subject = self._settings.room, self._settings.subject
        inbox = self._bus.subscribe(
            keys.everything(room) if subject is None else keys.subjects(room, "**", subject)
        )
        for key, payload in self._bus.fetch(keys.subjects(room, "imu/*/info", subject or "*")):
            self._take(key, payload)
        markers = Markers(self._pylsl)
        look_s = 0.0
        log.info("room %s is streamed by LSL, seen by: %s", room, self._settings.scope)
        while not stop.is_set():
            inbox.wait(WAIT_S)
            for key, payload in inbox.drain():
                self._take(key, payload)
            if time.monotonic() >= look_s:
                look_s = time.monotonic() + LOOK_S
                for name in markers.look():
                    log.info("markers of %r become events", name)
            for name, text, time_s in markers.pull():
                self._mark(name, text, time_s)
            self._heart.text = f"{len(self._outlets)} streams"
            self._heart.beat()
        log.info("%s ended", self._settings.id)

    # -- from the room -----------------------------------------------------------------------------------

    def _take(self, key: str, payload: bytes) -> None:
        try:
            parsed = keys.parse(key)
            if parsed.subject == keys.SERVICE or parsed.topic not in ("info", "imu", "skeleton", "event"):
                return
            message = decode_topic(payload, parsed.topic)
            match message:
                case Info():
                    self._inform(parsed, message)
                case SampleBatch():
                    self._samples(parsed, message)
                case Skeleton():
                    self._skeleton(parsed, message)
                case Event():
                    self._event(parsed, message)
        except WireError as error:
            self._heart.drops[error.drop.value] += 1
        except keys.BadKey:
            self._heart.drops[Drop.BAD_KEY.value] += 1

    def _inform(self, key: keys.Key, info: Info) -> None:
        self._infos[key.subject, key.detail] = info
        self._hosts[key.subject] = info.host
        self._asked_s.pop(info.host, None)
        self._compared.discard(info.host)  # who tells of a sensor may have begun anew, with another time

    def _samples(self, key: keys.Key, batch: SampleBatch) -> None:
        info = self._infos.get((key.subject, key.detail))
        if info is None:
            self._heart.drops[Drop.NO_INFO.value] += 1
            return
        if batch.late:
            self._heart.drops[Drop.LATE.value] += 1  # a stream of LSL only goes forward
            return
        samples = read_samples(batch)
        stream = streams.sample_stream(self._settings.room, key.subject, key.detail, info)
        self._push(key.subject, stream, streams.sample_rows(samples, info), samples.time_ns)
        if samples.acc is not None:
            watch = self._taps.setdefault((key.subject, key.detail), TapWatch())
            for taps in watch.feed(samples.time_ns, samples.acc):
                self._tapped(key, info, taps.times_ns)

    def _skeleton(self, key: keys.Key, skeleton: Skeleton) -> None:
        room, rate_hz = self._settings.room, TOPICS["skeleton"].rate_hz or 0.0
        of = (room, key.subject, skeleton.side, skeleton.origin, rate_hz)
        for stream, rows in (
            (streams.skeleton_stream(*of), streams.skeleton_row(skeleton)),
            (streams.angle_stream(*of), streams.angle_row(skeleton)),
        ):
            self._push(key.subject, stream, rows, [skeleton.time_ns])

    def _push(self, subject: str, stream: Stream, rows: Rows, times_ns: list[int]) -> None:
        clock = self._clock(subject)
        if clock is None:
            self._heart.drops["no_host_time"] += len(times_ns)
            return
        behind = self._outlet(stream).push(rows, [clock.lsl(t) for t in times_ns])
        if behind:
            self._heart.drops[Drop.TIME_BACKWARDS.value] += behind
        self._heart.counts["samples"] += len(times_ns) - behind

    def _outlet(self, stream: Stream) -> Outlet:
        outlet = self._outlets.get(stream.source_id)
        if outlet is None or outlet.stream is not stream:
            self._outlets[stream.source_id] = outlet = Outlet(self._pylsl, stream)
            log.info("stream %r: %d channels", stream.name, len(stream.channels))
        return outlet

    def _event(self, key: keys.Key, event: Event) -> None:
        clock = self._clock(key.subject)
        if event.kind == MARKER:
            return  # LSL has it already
        if clock is None:
            self._heart.drops["no_host_time"] += 1
            return
        outlet = self._outlet(streams.event_stream(self._settings.room, key.subject))
        outlet.push_text(streams.event_text(event), clock.lsl(event.time_ns))
        self._heart.counts["events"] += 1

    # -- time --------------------------------------------------------------------------------------------

    def _clock(self, subject: str) -> LslClock | None:
        """Return the clock of the host that a subject comes in through; None while nobody tells its time."""
        host = self._hosts.get(subject)
        if host is None:
            return None
        asked_s = self._asked_s.get(host)
        if asked_s is None or (host not in self._compared and time.monotonic() - asked_s > LOOK_S):
            self._compare(host)
            self._asked_s[host] = time.monotonic()
        return self._clocks.get(host)

    def _compare(self, host: str) -> None:
        """Compare a host's time with LSL's. What is known stays, unless that host began anew."""
        try:
            clock = follow_host_time(self._bus, self._settings.room, host, timeout_s=ANSWER_S)
        except NoHostTime as error:
            log.warning("%s", error)
            return
        self._compared.add(host)
        found = compare(clock.now_ns, self._pylsl.local_clock, clock.uncertainty_ns)
        known = self._clocks.get(host)
        if known is not None and not known.agrees(found):
            log.warning("host %s began anew: its time is another one now", host)
        if known is None or not known.agrees(found):
            self._clocks[host] = found
            self._heart.counts[f"clock_uncertainty_ns_{host}"] = found.uncertainty_ns

    # -- back into the room ------------------------------------------------------------------------------

    def _tapped(self, key: keys.Key, info: Info, times_ns: tuple[int, int, int]) -> None:
        event = Event(
            time_ns=times_ns[0],
            kind=TRIPLE_TAP,
            text=f"{key.detail} tapped three times",
            data={"segment": key.detail, "node": info.node, "times_ns": list(times_ns)},
        )
        self._bus.put(keys.event(self._settings.room, key.subject), encode(event))
        log.info("%s of %s was tapped three times", key.detail, key.subject)

    def _mark(self, stream: str, text: str, time_s: float) -> None:
        for subject in sorted(self._hosts):
            clock = self._clock(subject)
            if clock is None:
                self._heart.drops["no_host_time"] += 1
                continue
            event = Event(
                time_ns=clock.host(time_s), kind=MARKER, text=text[:1000], data={"stream": stream[:200]}
            )
            self._bus.put(keys.event(self._settings.room, subject), encode(event))
            self._heart.counts["markers"] += 1
