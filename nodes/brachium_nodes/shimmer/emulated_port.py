"""An emulated Shimmer3 behind a pseudo-terminal, worn on a segment of an emulated person."""

import asyncio
import logging
import os
import pty
import tty
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from errno import ENOENT
from pathlib import Path

from brachium_body.segments import SEGMENTS, Segment
from brachium_nodes.node_stream import Stop, Timeline
from brachium_nodes.sensors import calibrated, generator
from brachium_nodes.shimmer.emulated import EmulatedShimmer, Floats
from brachium_nodes.wearer import Wearer, WearerSettings
from brachium_nodes.wearing import Wearing

log = logging.getLogger(__name__)

RATE_HZ = 51.2
LOOK_S = 0.004
LISTEN_S = 15.0


@dataclass(frozen=True, kw_only=True)
class ShimmerTwin:
    """A second sensor on the segment that a wearer's first node is worn on, as the paper's socket held it."""

    path: Path
    """Where the port is to be found: a symbolic link to a pseudo-terminal."""
    delay_s: float = 0.02
    """Least time from a sample to its arrival: a clock that is told one way only comes out late by it."""
    jitter_s: float = 0.004
    """Mean of what comes on top."""


def twin_of(settings: WearerSettings) -> tuple[Wearer, Segment, Segment]:
    """Return a wearer of the same movement with one sensor; the name it is drawn under; its segment."""
    seat = settings.worn()[0]
    free: list[Segment] = [segment for segment in SEGMENTS if segment not in settings.worn()]
    name = free[0]
    wearing = Wearing(seats={name: seat})
    return Wearer(replace(settings, segments=(name,), rate_hz=RATE_HZ, wearing=wearing)), name, seat


class EmulatedPort:
    """The device on its pseudo-terminal."""

    def __init__(self, twin: ShimmerTwin, settings: WearerSettings) -> None:
        self._twin = twin
        self._wearer, name, self.segment = twin_of(settings)
        self._name: Segment = name
        self._clock = self._wearer.clocks[self._name]
        self._calibration = self._wearer.info(self._name).calibration
        self.device = EmulatedShimmer(self._measured, seed=settings.seed)
        self._random = generator(settings.seed, self._name, "bluetooth")

    def _measured(self, number: int) -> tuple[Floats, Floats, Floats]:
        made = self._wearer.samples(self._name, number, 1)
        acc, gyr, mag = calibrated(self._calibration, made.acc, made.gyr, made.mag)
        return acc[0], gyr[0], mag[0]

    async def listened_to(self, stop: Stop) -> bool:
        """Wait until a host has started the device, at most LISTEN_S; return whether one has."""
        for _ in range(round(LISTEN_S / LOOK_S)):
            if self.device.streaming or stop.is_set():
                break
            await asyncio.sleep(LOOK_S)
        return self.device.streaming

    async def serve(self, timeline: Timeline, stop: Stop) -> None:
        """Answer, and stream in real time from source time 0 on, until `stop` is set."""
        with _terminal(self._twin.path) as master:
            number, arrives_s = 0, 0.0
            waiting: list[tuple[float, bytes]] = []
            while not stop.is_set():
                await asyncio.sleep(LOOK_S)
                answer = self.device.receive(_read(master))
                if answer:
                    _write(master, answer)
                now_s = timeline.now_s()
                first = round((now_s - self._clock.phase_s) / self._clock.period_s)
                if not self.device.streaming or not timeline.begun:
                    number, waiting = max(first, 0) if timeline.begun else 0, []
                    continue
                while (taken_s := self._clock.phase_s + number * self._clock.period_s) <= now_s:
                    ticks = int(32768.0 * (self._clock.start_s + taken_s * (1.0 + self._clock.skew)))
                    delay_s = self._twin.delay_s + float(self._random.exponential(self._twin.jitter_s))
                    arrives_s = max(arrives_s, taken_s + delay_s)
                    waiting.append((arrives_s, self.device.packet(number, ticks)))
                    number += 1
                while waiting and waiting[0][0] <= now_s:
                    _write(master, waiting.pop(0)[1])


async def worn(
    twin: ShimmerTwin | None, settings: WearerSettings, timeline: Timeline, stop: Stop
) -> asyncio.Future[None]:
    """Put the device on, wait a while for somebody to listen to it, and return what serves it: to cancel.

    Raises OSError when the port cannot be made.
    """
    if twin is None:
        return asyncio.Future()
    port = EmulatedPort(twin, settings)
    serving = asyncio.create_task(port.serve(timeline, stop))
    listening = asyncio.create_task(port.listened_to(stop))
    await asyncio.wait({serving, listening}, return_when=asyncio.FIRST_COMPLETED)
    if not listening.done():
        listening.cancel()
        serving.result()
    elif not listening.result():
        log.warning("nobody listens at %s: brachium shimmer would", twin.path)
    return serving


def _read(master: int) -> bytes:
    try:
        return os.read(master, 1024)
    except BlockingIOError:
        return b""


def _write(master: int, data: bytes) -> None:
    """Send `data`; to a host that does not read it is lost, as over the radio."""
    with suppress(BlockingIOError):
        os.write(master, data)


@contextmanager
def _terminal(path: Path) -> Iterator[int]:
    """Yield the device's end of a new pseudo-terminal whose other end is to be found at `path`."""
    if not path.parent.is_dir():
        raise FileNotFoundError(ENOENT, "no such folder", str(path.parent))
    master, slave = pty.openpty()
    tty.setraw(master)
    tty.setraw(slave)
    os.set_blocking(master, False)
    path.unlink(missing_ok=True)
    path.symlink_to(os.ttyname(slave))
    try:
        yield master
    finally:
        path.unlink(missing_ok=True)
        os.close(master)
        os.close(slave)
