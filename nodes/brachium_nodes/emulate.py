"""The emulated wearer in real time: each segment a node of its own, and the truth beside it."""

import asyncio
import itertools
import logging
import secrets
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from math import ceil, inf
from pathlib import Path
from threading import Event

from brachium_body.segments import Side
from brachium_nodes.direct_node import DirectHost, DirectSink
from brachium_nodes.emulated_flash import with_flash
from brachium_nodes.emulated_nodes import alike, node_id, node_streams
from brachium_nodes.firmware_wearer import FirmwareWearer
from brachium_nodes.gateway import token_sha256
from brachium_nodes.host_claim import checked_host
from brachium_nodes.link import FaultSettings
from brachium_nodes.node_stream import NodeStream, StreamCount, Timeline
from brachium_nodes.roster import NodeEntry
from brachium_nodes.sending import Sink, SocketSink, send_streams
from brachium_nodes.shimmer.emulated_port import ShimmerTwin, worn
from brachium_nodes.wearer import Wearer, WearerSettings
from brachium_wire import keys
from brachium_wire.bus import DEFAULT_ENDPOINT, Bus
from brachium_wire.codec import encode
from brachium_wire.heart import Heart
from brachium_wire.hosttime import NoHostTime, follow_host_time
from brachium_wire.messages import Session, Skeleton

log = logging.getLogger(__name__)

TRUTH_NS = 20_000_000
LATE_S = 3.0
"""A source that is later than this tells so, once."""
LARGEST_BATCH = 96
"""Samples of 40 bytes that fit in a frame."""


@dataclass(frozen=True, kw_only=True)
class EmulateSettings:
    """Emulated wearers and the way in for their nodes."""

    endpoint: str = DEFAULT_ENDPOINT
    room: str = keys.DEFAULT_ROOM
    id: str = "emulate"
    """Names the service; with `direct` also the host."""
    gateway: str = "ws://127.0.0.1:8765/node"
    token: str = ""
    """The nodes' token at the gateway."""
    firmware: bool = False
    """The nodes are the wearables' firmware on MicroPython; it makes its own faults."""
    direct: bool = False
    """Publish without a gateway."""
    speed: float = 1.0
    """Only with `direct`: a gateway keeps real time."""
    seconds: float | None = None
    subject: str = "p01"
    wearers: int = 1
    """More than one: subjects p001, p002, ..."""
    alike: bool = True
    """All wearers move as the first: a hundred cost little more than one. Else each has the next seed."""
    wearer: WearerSettings = field(default_factory=WearerSettings)
    faults: FaultSettings = field(default_factory=FaultSettings)
    truth: bool = True
    session: bool = True
    shimmer: ShimmerTwin | None = None
    """A Shimmer3 beside the first node; brachium shimmer makes it `<subject>.ref`."""
    flash: Path | None = None
    """Folder in which the nodes keep what they must not forget when they are switched off."""

    def __post_init__(self) -> None:
        """Raise ValueError for what cannot be emulated."""
        if self.speed <= 0.0 or (self.speed != 1.0 and not self.direct):
            raise ValueError(f"speed {self.speed} cannot be used; give a positive one, and direct if not 1")
        if not self.direct and not self.token:
            raise ValueError("nodes need a token to join a gateway; give one, or publish directly")
        if self.firmware and (self.direct or self.wearers != 1 or self.wearer.mag_every != 1):
            raise ValueError(
                "firmware is worn by one wearer, through a gateway, and asks for the field itself"
            )
        if self.shimmer is not None and (self.wearers > 1 or self.speed != 1.0):
            raise ValueError("a Shimmer3 is worn by one wearer, in real time")
        if self.wearers < 1:
            raise ValueError(f"{self.wearers} wearers cannot be; give 1 or more")
        if self.wearer.batch > LARGEST_BATCH:
            raise ValueError(
                f"batches of {self.wearer.batch} fit no frame; give 1 to {LARGEST_BATCH} samples"
            )
        checked_host(self.id)

    def subjects(self) -> tuple[str, ...]:
        """Return the subjects' names."""
        if self.wearers == 1:
            return (keys.subject_chunk(self.subject),)
        return tuple(f"p{number:03d}" for number in range(1, self.wearers + 1))


@dataclass(frozen=True, kw_only=True)
class EmulateReport:
    """What was sent and what was done to it, by subject and segment."""

    streams: dict[str, dict[str, StreamCount]]


def node_entries(settings: EmulateSettings) -> tuple[NodeEntry, ...]:
    """Return what a gateway's table needs so that these wearers' nodes are let in."""
    wearer = Wearer(settings.wearer)
    return tuple(
        NodeEntry(
            id=node_id(subject, segment),
            token_sha256=token_sha256(settings.token),
            subject=subject,
            segment=segment,
            mounting=wearer.info(segment).mounting,
        )
        for subject in settings.subjects()
        for segment in wearer.segments
    )


def run(settings: EmulateSettings, stop: Event) -> EmulateReport:
    """Emulate until `seconds` are over or `stop` is set; return what was sent.

    Raises NotWelcome when the gateway will not have these nodes, and NoRouter.
    """
    with Bus.open(settings.endpoint, stop=stop) as bus:
        return asyncio.run(_Emulation(settings, bus, stop).run())


class _Emulation:
    def __init__(self, settings: EmulateSettings, bus: Bus, stop: Event) -> None:
        self._settings, self._bus, self._stop = settings, bus, stop
        self._timeline = Timeline(settings.speed)
        subjects, seed = settings.subjects(), settings.wearer.seed
        together = [subjects] if settings.alike else [(subject,) for subject in subjects]
        self._wearers = [
            (Wearer(replace(settings.wearer, seed=seed + number)), names)
            for number, names in enumerate(together)
        ]
        """Who moves, and the subjects that move so."""
        self._direct: DirectHost | None = None
        self._heart = Heart(bus, settings.room, "emulate", settings.id)
        self._nodes: list[tuple[NodeStream, Sink]] = []

    async def run(self) -> EmulateReport:
        settings = self._settings
        if settings.direct:
            self._direct = DirectHost(self._bus, settings.room, settings.id, self._timeline)
        if settings.session:
            twins = [f"{subject}{keys.REFERENCE}" for subject in settings.subjects() if settings.shimmer]
            for subject in (*settings.subjects(), *twins):
                self._bus.retain(keys.session(settings.room, subject), encode(session(settings.wearer)))
        end_s = inf if settings.seconds is None else settings.seconds
        twin = await worn(settings.shimmer, settings.wearer, self._timeline, self._stop)
        try:
            counts = await (self._wear_firmware(end_s) if settings.firmware else self._send(end_s))
        finally:
            twin.cancel()
        report: dict[str, dict[str, StreamCount]] = {}
        for (subject, segment), count in counts.items():
            report.setdefault(subject, {})[segment] = count
            self._heart.counts["samples"] += count.sent
        self._heart.beat(now=True)
        return EmulateReport(streams=report)

    async def _wear_firmware(self, end_s: float) -> dict[tuple[str, str], StreamCount]:
        settings, ((wearer, (subject,)),) = self._settings, self._wearers
        worn = FirmwareWearer(wearer=wearer, subject=subject, gateway=settings.gateway, token=settings.token)
        return await worn.run(self._timeline, end_s, self._stop, self._beside)

    async def _send(self, end_s: float) -> dict[tuple[str, str], StreamCount]:
        settings, boot = self._settings, secrets.randbits(32)
        streams = [
            with_flash(stream, settings.flash)
            for wearer, subjects in self._wearers
            for stream in alike(node_streams(subjects[0], wearer, settings.faults, boot), subjects)
        ]
        self._nodes = [(stream, self._sink(stream)) for stream in streams]
        return await send_streams(self._nodes, self._timeline, end_s, self._stop, self._beside)

    def _sink(self, stream: NodeStream) -> Sink:
        if self._direct is not None:
            return DirectSink(self._direct, stream)
        return SocketSink(self._settings.gateway, self._settings.token, stream, self._timeline)

    async def _beside(self) -> None:
        """Publish truth and health while the nodes send."""
        try:
            origin_ns = await asyncio.to_thread(self._origin_ns)
        except NoHostTime as error:
            log.warning("no truth will be told: %s", error)
            return
        first_ns, warned = ceil(origin_ns / TRUTH_NS) * TRUTH_NS, False
        truth = self._truth(origin_ns, first_ns)
        for tick in itertools.count():
            self._heart.beat()
            due_s = (first_ns + tick * TRUTH_NS - origin_ns) * 1e-9
            if not await self._timeline.reach(due_s, self._stop):
                return
            if not warned and self._timeline.now_s() - due_s > LATE_S * self._timeline.speed:
                log.warning("this machine is too slow for what is emulated: samples come late")
                warned = True
            for skeletons, places in truth:
                payload = encode(next(skeletons))
                for place in places:
                    self._bus.put(place, payload)

    def _truth(self, origin_ns: int, first_ns: int) -> list[tuple[Iterator[Skeleton], list[str]]]:
        """Return what each arm does, tick by tick, and the keys it is told on."""
        if not self._settings.truth:
            return []
        return [
            (
                wearer.skeleton_stream(side, origin_ns, first_ns, TRUTH_NS),
                [keys.truth(self._settings.room, subject, side) for subject in subjects],
            )
            for wearer, subjects in self._wearers
            for side in sides(wearer.settings)
        ]

    def _origin_ns(self) -> int:
        """Return host time at true time 0: the gateway's, for samples get theirs from it."""
        if self._direct is not None:
            return self._direct.origin_ns
        hosts = [sink.host for _, sink in self._nodes if isinstance(sink, SocketSink) and sink.host]
        host = hosts[0] if hosts else "gateway"
        return follow_host_time(self._bus, self._settings.room, host).at(self._timeline.start_ns)


def sides(person: WearerSettings) -> tuple[Side, ...]:
    """Return the arms that exercise."""
    return ("right", "left") if person.arms == "both" else (person.arms,)


def session(person: WearerSettings) -> Session:
    """Return what a subject's session says of an emulated wearer."""
    return Session(side=person.arms, height_m=person.height_m, facing_deg=0.0, exercise=person.exercise)
