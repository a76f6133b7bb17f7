"""A capture folder or a recording played back as if its sensors were nodes."""

import asyncio
import logging
import secrets
from dataclasses import dataclass
from math import inf
from pathlib import Path
from threading import Event

from brachium_nodes.direct_node import DirectHost, DirectSink
from brachium_nodes.gateway import token_sha256
from brachium_nodes.host_claim import checked_host
from brachium_nodes.node_stream import NodeStream, StreamCount, Timeline
from brachium_nodes.playback import Source, capture_source, recording_source
from brachium_nodes.replay import replay
from brachium_nodes.roster import NodeEntry
from brachium_nodes.sending import Sink, SocketSink, send_streams
from brachium_wire import capture, keys, recording
from brachium_wire.bus import DEFAULT_ENDPOINT, Bus
from brachium_wire.codec import encode
from brachium_wire.heart import Heart

log = logging.getLogger(__name__)

LOOK_S = 0.05


@dataclass(frozen=True, kw_only=True)
class PlaySettings:
    """What is played, and the way in for its nodes."""

    path: Path
    """A capture folder, or a recording."""
    endpoint: str = DEFAULT_ENDPOINT
    room: str = keys.DEFAULT_ROOM
    id: str = "play"
    """Names the service; with `direct` also the host."""
    gateway: str = "ws://127.0.0.1:8765/node"
    token: str = ""
    """The nodes' token at the gateway."""
    direct: bool = False
    """Publish without a gateway; a recording's batches then keep their bytes."""
    speed: float = 1.0
    """Only with `direct`: a gateway keeps real time."""
    seconds: float | None = None
    subject: str = "p01"
    """Who a capture is of; a recording names its subjects itself."""
    session: bool = True

    def __post_init__(self) -> None:
        """Raise ValueError for what cannot be played."""
        if self.speed <= 0.0 or (self.speed != 1.0 and not self.direct):
            raise ValueError(f"speed {self.speed} cannot be used; give a positive one, and direct if not 1")
        if not self.direct and not self.token:
            raise ValueError("nodes need a token to join a gateway; give one, or publish directly")
        checked_host(self.id)


@dataclass(frozen=True, kw_only=True)
class PlayReport:
    """What was sent, by subject and segment."""

    streams: dict[str, dict[str, StreamCount]]


def node_entries(settings: PlaySettings) -> tuple[NodeEntry, ...]:
    """Return what a gateway's table needs so that the nodes of this capture or recording are let in."""
    return tuple(
        NodeEntry(
            id=stream.hello.node,
            token_sha256=token_sha256(settings.token),
            subject=stream.subject,
            segment=stream.segment,
            mounting=stream.mounting,
        )
        for stream in _source(settings).streams
    )


def run(settings: PlaySettings, stop: Event) -> PlayReport:
    """Play until the end, until `seconds` of it are over, or until `stop` is set; return what was sent.

    Raises CaptureError, RecordingError, NotWelcome or NoRouter, each with one line.
    """
    end_s = inf if settings.seconds is None else settings.seconds
    as_it_is = settings.direct and settings.path.is_file()
    if as_it_is:
        recording.read(settings.path).close()  # a wrong file is named before the bus is opened
    source = None if as_it_is else _source(settings)
    with Bus.open(settings.endpoint, stop=stop) as bus:
        timeline = Timeline(settings.speed)
        heart = Heart(bus, settings.room, "play", settings.id)
        if source is None:
            counts = replay(settings.path, bus, settings.room, settings.id, timeline, end_s, stop, heart)
        else:
            counts = asyncio.run(_send(settings, source, bus, timeline, end_s, stop, heart))
        heart.counts["samples"] = sum(count.sent for count in counts.values())
        heart.beat(now=True)
    report: dict[str, dict[str, StreamCount]] = {}
    for (subject, segment), count in counts.items():
        report.setdefault(subject, {})[segment] = count
    return PlayReport(streams=report)


def _source(settings: PlaySettings) -> Source:
    boot = secrets.randbits(32)
    if not settings.path.exists():
        raise recording.RecordingError(f"{settings.path}: no such file or folder; give one that is there")
    if settings.path.is_dir():
        return capture_source(capture.load(settings.path), keys.subject_chunk(settings.subject), boot)
    return recording_source(lambda: recording.read(settings.path), boot)


async def _send(
    settings: PlaySettings,
    source: Source,
    bus: Bus,
    timeline: Timeline,
    end_s: float,
    stop: Event,
    heart: Heart,
) -> dict[tuple[str, str], StreamCount]:
    host = DirectHost(bus, settings.room, settings.id, timeline) if settings.direct else None

    def sink(stream: NodeStream) -> Sink:
        if host is not None:
            return DirectSink(host, stream)
        return SocketSink(settings.gateway, settings.token, stream, timeline)

    async def beside() -> None:
        while True:
            heart.beat()
            await asyncio.sleep(LOOK_S)

    for subject, session in source.sessions.items():
        if settings.session:
            bus.retain(keys.session(settings.room, subject), encode(session))
    for warning in source.warnings:
        log.warning("%s", warning)
    return await send_streams([(s, sink(s)) for s in source.streams], timeline, end_s, stop, beside)
