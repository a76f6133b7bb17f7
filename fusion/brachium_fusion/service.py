"""The live fusion service: bus -> pipeline -> bus. All decisions are the pipeline's; this only carries."""

import gc
import logging
import threading
import time
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import msgspec

from brachium_fusion.calibration_desk import CalibrationDesk, Reply
from brachium_fusion.calibration_wish import checked_wish, checked_zero
from brachium_fusion.kept import Kept
from brachium_fusion.pipeline import Pipeline
from brachium_fusion.pose_watch import STILL_S
from brachium_fusion.sensor_desk import SensorDesk
from brachium_fusion.settings import Change, Settings
from brachium_fusion.wear_desk import WearDesk
from brachium_wire import keys
from brachium_wire.bus import DEFAULT_ENDPOINT, Bus, Inbox
from brachium_wire.codec import Drop, WireError, decode, decode_topic, encode
from brachium_wire.heart import Heart
from brachium_wire.messages import Answer, Calibration, Command, Event

log = logging.getLogger(__name__)

DRAIN_S = 0.01
MOST_DRAIN_S = 0.04
DRAIN_S_PER_SUBJECT = 0.0004
"""How often arrivals are taken. For few subjects every 10 ms, of which a skeleton waits half on average. For
a hundred every 40 ms, because a round of kinematics costs about a millisecond whatever is in it."""

GC_ALLOCATIONS = 20_000
"""Python's 700 would look for cycles, of which messages make none, a hundred times a second."""

PUT_AT_ONCE, PUT_PAUSE_S = 100, 0.001
"""After a hold-up a thousand skeletons are due at once: pauses let the send queue take them all."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FuseSettings:
    """What `brachium fuse` takes."""

    endpoint: str = DEFAULT_ENDPOINT
    room: str = keys.DEFAULT_ROOM
    service_id: str = "fusion"
    pipeline: Settings = field(default_factory=Settings)
    keep: Path | None = None
    """Folder in which calibrations are kept; None keeps none."""


def run(settings: FuseSettings, stop: threading.Event) -> None:
    """Serve until `stop` is set."""
    with Bus.open(settings.endpoint, stop=stop, timeout_s=None) as bus:
        service = FusionService(bus, settings)
        # What was made up to here stays; what comes after is mostly messages that live for a turn.
        gc.freeze()
        gc.set_threshold(GC_ALLOCATIONS)
        while not stop.wait(service.pause_s()):
            service.turn()
        service.close()


class FusionService:
    """One turn drains what arrived, lets the pipeline solve it and publishes what came out."""

    def __init__(self, bus: Bus, settings: FuseSettings) -> None:
        self._bus, self._room = bus, settings.room
        self._pipeline = Pipeline(settings.pipeline)
        self._door: Counter[str] = Counter()
        """What was refused before it reached a subject."""
        self._inbox: Inbox = bus.subscribe(keys.subjects(settings.room, "imu/**"))
        self._sessions: Inbox = bus.subscribe(keys.subjects(settings.room, "session"))
        self._told: set[str] = set()
        self._asked: list[tuple[keys.Key, bytes, Reply]] = []
        self._lock = threading.Lock()
        kept = None if settings.keep is None else Kept(settings.keep)
        self._desk = CalibrationDesk(self._pipeline, settings.room, kept)
        self._sensors = SensorDesk(self._pipeline)
        self._wear = WearDesk(self._pipeline, settings.room)
        self._calibrations: dict[str, Calibration] = {}
        """What was last said of how each subject's sensors are worn."""
        for verb in ("calibrate", "zero", "record", "wear-check"):
            bus.serve_later(keys.commands(settings.room, verb), self._on_command)
        self._heard(bus.fetch(keys.subjects(settings.room, "imu/*/info")))
        for subject in sorted(self._pipeline.subjects):
            log.warning(
                "%s: its sensors ran before fusion did, and are not calibrated: "
                "stand still in the n-pose for %g s, or ask for a calibration",
                subject,
                STILL_S,
            )
        for key, payload in bus.fetch(keys.subjects(settings.room, "session")):
            self._heard_session(key, payload)
        # Last: who sees it alive may ask it at once.
        self._heart = Heart(bus, settings.room, "fusion", settings.service_id)

    def pause_s(self) -> float:
        """Return how long to wait before the next turn."""
        return min(max(DRAIN_S, DRAIN_S_PER_SUBJECT * len(self._pipeline.subjects)), MOST_DRAIN_S)

    def turn(self) -> None:
        """Take what arrived, publish what it gives."""
        for key, payload in self._sessions.drain():
            self._heard_session(key, payload)
        self._heard(self._inbox.drain())
        for subject, found in self._desk.changes():
            self._apply(subject, "align", found)
        self._wear.turn()
        self._publish()
        self._tell_settings()
        with self._lock:
            asked, self._asked = self._asked, []
        for parsed, question, reply in asked:
            self._answer(parsed, question, reply)
        self._desk.give_up()
        self._sensors.give_up()
        self._beat()

    def close(self) -> None:
        """Tell the last health and who still waits for an answer."""
        self._desk.close()
        self._sensors.close()
        self._wear.close()
        self._beat(now=True)
        self._heart.end()

    def _heard(self, messages: list[tuple[str, bytes]]) -> None:
        parsed = []
        for key, payload in messages:
            try:
                parsed.append((keys.parse(key), payload))
            except keys.BadKey:
                self._door[Drop.BAD_KEY.value] += 1
        self._pipeline.feed_all(parsed)
        for place, payload in parsed:
            self._sensors.see(place, payload)
            self._wear.see(place, payload)

    def _heard_session(self, key: str, payload: bytes) -> None:
        try:
            subject = keys.parse(key).subject
            session = decode_topic(payload, "session")
        except keys.BadKey:
            self._door[Drop.BAD_KEY.value] += 1
        except WireError as error:
            self._door[error.drop.value] += 1
        else:
            try:
                self._apply(subject, "session", msgspec.to_builtins(session))
            except ValueError as error:
                log.warning("%s: session left aside: %s", subject, error)
                self._door[Drop.OUT_OF_RANGE.value] += 1

    def _tell_settings(self) -> None:
        """Say once for each subject how it is solved: a recording without a snapshot repeats it so."""
        for subject in self._pipeline.subjects.keys() - self._told:
            self._told.add(subject)
            event = Event(
                time_ns=self._pipeline.subject(subject).next_tick_ns(),
                kind="settings",
                data=self._pipeline.settings.plain(),
            )
            self._bus.put(keys.event(self._room, subject), encode(event))

    def _publish(self) -> None:
        for solved in self._pipeline.skeletons():
            skeleton = solved.skeleton
            self._bus.put(keys.skeleton(self._room, solved.subject, skeleton.side), encode(skeleton))
            self._heart.counts["skeletons"] += 1
            if self._heart.counts["skeletons"] % PUT_AT_ONCE == 0:
                time.sleep(PUT_PAUSE_S)
        news, self._pipeline.calibrations = self._pipeline.calibrations, []
        for subject, calibration in news:
            self._calibrations[subject] = calibration
            self._tell_calibration(subject)
            for warning in calibration.warnings:
                log.warning("%s: %s", subject, warning)
            if calibration.state in ("done", "refused"):
                self._desk.finished(subject, calibration)
        told = self._sensors.news | self._wear.news
        self._sensors.news, self._wear.news = set(), set()
        for subject in told:
            self._tell_calibration(subject)

    def _tell_calibration(self, subject: str) -> None:
        whole = self._sensors.complete(subject, self._calibrations.get(subject))
        whole = self._wear.complete(subject, whole)
        self._bus.retain(keys.calibration(self._room, subject), encode(whole))

    # -- commands ----------------------------------------------------------------------------------------

    def _on_command(self, key: str, question: bytes, reply: Reply) -> None:
        """Runs on Zenoh's thread: only keeps the question for the next turn."""
        try:
            parsed = keys.parse(key)
        except keys.BadKey as error:
            reply(encode(Answer(ok=False, reason=str(error))))
            return
        with self._lock:
            self._asked.append((parsed, question, reply))

    def _answer(self, key: keys.Key, question: bytes, reply: Reply) -> None:
        try:
            command = decode(question, Command) if question else Command()
            if key.subject not in self._pipeline.subjects:
                raise ValueError(f"no sensor of subject {key.subject!r} has been heard yet")
            if key.detail == "calibrate" and "sensor" in command.arguments:
                self._sensors.begin(key.subject, command.arguments, reply)
            elif key.detail == "wear-check":
                self._wear.begin(key.subject, command.arguments, reply)
            elif key.detail == "record":
                snapshot = self._pipeline.snapshot(key.subject)
                reply(encode(Answer(ok=True, data={"snapshot": snapshot})))
            else:
                check = checked_wish if key.detail == "calibrate" else checked_zero
                wish = check(command.arguments)
                self._desk.wait(key.subject, wish, reply)
                self._apply(key.subject, key.detail, wish)
        except (WireError, ValueError, TypeError) as error:
            reply(encode(Answer(ok=False, reason=str(error))))

    def _apply(self, subject: str, kind: str, data: dict[str, Any]) -> None:
        """Apply a change from the next tick on, and say so on the bus: a recording repeats it at that
        tick."""
        change = Change(self._pipeline.subject(subject).next_tick_ns(), kind, data)
        self._pipeline.apply(subject, change)
        event = Event(time_ns=change.from_ns, kind="applied", text=kind, data=data)
        self._bus.put(keys.event(self._room, subject), encode(event))

    def _beat(self, *, now: bool = False) -> None:
        heart = self._heart
        heart.counts["subjects"] = len(self._pipeline.subjects)
        heart.counts["batches"] = self._inbox.received
        heart.drops = self._door + self._pipeline.drops
        for subject in self._pipeline.subjects.values():
            heart.drops += subject.drops
        if self._inbox.dropped:
            heart.drops["inbox_overflow"] = self._inbox.dropped
        heart.beat(now=now)
