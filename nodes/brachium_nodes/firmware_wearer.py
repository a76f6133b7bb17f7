"""An emulated wearer whose nodes are the firmware itself: one MicroPython process a segment."""

import asyncio
import re
import time
from collections.abc import Callable, Coroutine
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

from brachium_body.segments import Segment
from brachium_nodes.emulated_board.settings import BoardSettings
from brachium_nodes.emulated_nodes import node_id
from brachium_nodes.firmware_build import build
from brachium_nodes.firmware_host import FirmwareNode, feed, prepare, stop_all
from brachium_nodes.node_stream import Stop, StreamCount, Timeline
from brachium_nodes.wearer import Wearer

AHEAD_S = 6.0
"""So far ahead it is written down what a sensor will measure."""
STARTS_S = 3.0
"""Until true time 0: the interpreters start and the nodes join."""
REFUSALS = 0.01
"""Share of the transfers that the sensor's bus refuses, as a long wire's does."""

_SENT = re.compile(r"^sent (\d+), dropped (\d+), next (\d+)$", re.MULTILINE)


@dataclass(frozen=True, kw_only=True)
class FirmwareWearer:
    """Who wears the nodes, and how they reach their gateway."""

    wearer: Wearer
    subject: str
    gateway: str
    token: str

    async def run(
        self, timeline: Timeline, end_s: float, stop: Stop, beside: Callable[[], Coroutine[None, None, None]]
    ) -> dict[tuple[str, str], StreamCount]:
        """Wear the nodes until source time `end_s` or `stop`; return what each sent.

        `beside` runs meanwhile, from source time 0 on. Raises NoMicroPython, or RuntimeError when one broke.
        """
        with TemporaryDirectory(prefix="brachium-") as place:
            made = await asyncio.to_thread(build, Path(place) / "build")
            timeline.start_ns = time.monotonic_ns() + round(1e9 * STARTS_S)
            folders: dict[Segment, Path] = {
                segment: Path(place) / segment for segment in self.wearer.segments
            }
            for segment, folder in folders.items():
                await asyncio.to_thread(self._prepare, segment, folder, timeline.start_ns // 1000)
            nodes: dict[Segment, FirmwareNode] = {
                segment: FirmwareNode.start(folder, made) for segment, folder in folders.items()
            }
            tasks = [asyncio.create_task(beside())]
            tasks += [
                asyncio.create_task(self._go_on_writing(segment, folder, timeline))
                for segment, folder in folders.items()
            ]
            try:
                await self._wait(timeline, end_s, stop, nodes)
            finally:
                for task in tasks:
                    task.cancel()
                await asyncio.to_thread(stop_all, nodes.values())
            return {(self.subject, segment): _count(node.said()) for segment, node in nodes.items()}

    async def _wait(
        self, timeline: Timeline, end_s: float, stop: Stop, nodes: dict[Segment, FirmwareNode]
    ) -> None:
        while timeline.now_s() < end_s and not stop.is_set():
            for segment, node in nodes.items():
                if node.process.poll() is not None:
                    raise RuntimeError(f"the node of {segment} ended: {node.said()[-500:]}")
            await asyncio.sleep(0.05)

    def _prepare(self, segment: Segment, folder: Path, start_us: int) -> None:
        rate_hz = self.wearer.settings.rate_hz
        prepare(
            folder,
            node_id(self.subject, segment),
            self.token,
            self.wearer,
            segment,
            seconds=AHEAD_S,
            start_us=start_us,
            gateway=self.gateway,
            board=BoardSettings(refusals=REFUSALS),
            batch=10 if rate_hz > 50.0 else 5,
        )

    async def _go_on_writing(self, segment: Segment, folder: Path, timeline: Timeline) -> None:
        """Append what the sensor will measure, a second at a time."""
        rate_hz = self.wearer.settings.rate_hz
        written = int(AHEAD_S * rate_hz)
        while True:
            if written > (timeline.now_s() + AHEAD_S - 1.0) * rate_hz:
                await asyncio.sleep(0.1)
                continue
            more = feed(self.wearer, segment, BoardSettings(), written, int(rate_hz))
            with (folder / "samples.bin").open("ab") as file:
                file.write(more)
            written += int(rate_hz)
            await asyncio.sleep(0)


def _count(said: str) -> StreamCount:
    """Return what a node says on its serial line as it ends."""
    found = _SENT.findall(said)
    if not found:
        return StreamCount()
    sent, dropped, following = map(int, found[-1])
    return StreamCount(sent=sent, lost=dropped, dropped=dropped, next_sequence=following)
