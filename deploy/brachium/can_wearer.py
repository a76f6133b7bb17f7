"""One node of an emulated wearer, as a process that can be killed: `python -m brachium.can_wearer`.

All nodes of a wearer are told the same moment of the monotonic clock as true time 0. With a jump, every node
gives orientations in place of raw samples, and one's heading is another from a moment on; or the nodes give
raw samples, and one's magnetic field is turned.
"""

import argparse
import asyncio
import itertools
import logging
import threading
from collections.abc import Iterator
from dataclasses import replace

import msgspec
import numpy as np

from brachium.shell import stop_on_signals
from brachium_body import rotation
from brachium_nodes.emulated_nodes import node_streams
from brachium_nodes.link import FaultSettings
from brachium_nodes.node_frames import Batch
from brachium_nodes.node_stream import NodeStream, Outgoing, Timeline
from brachium_nodes.sending import SocketSink, send_streams
from brachium_nodes.wearer import Wearer, WearerSettings
from brachium_wire import keys
from brachium_wire.bus import Bus
from brachium_wire.codec import encode
from brachium_wire.hosttime import follow_host_time

TRUTH_NS = 20_000_000
SEGMENTS = ("upper_arm_r", "forearm_r", "hand_r")


def wearer(segments: tuple[str, ...] = SEGMENTS) -> Wearer:
    """Return the person that all processes agree on, with some of the sensors."""
    made = WearerSettings(exercise="drinking", level="ideal", seed=3, batch=2, segments=segments)  # type: ignore[arg-type]
    return Wearer(made)


class Appointed(Timeline):
    """A timeline whose source time 0 was agreed on before."""

    def __init__(self, start_ns: int) -> None:
        super().__init__()
        self._appointed_ns = self.start_ns = start_ns

    def start(self) -> None:
        """Begin when it was agreed."""
        self.start_ns = self._appointed_ns


def orientations(stream: NodeStream, of: Wearer, jump_s: float | None, jump_deg: float) -> Iterator[Outgoing]:
    """Yield a node's packets with its true orientation, its heading turned from `jump_s` on."""
    for packet in stream.packets:
        truth = of.truth(packet.times_s, "right").world_from_sensor[stream.segment]
        turned = rotation.multiply(rotation.about(2, np.radians(jump_deg)), truth)
        late = packet.times_s >= (np.inf if jump_s is None else jump_s)
        quat = np.where(late[:, None], turned, truth).astype("<f4").tobytes()
        batch = Batch(
            sequence=packet.batch.sequence,
            device_us=packet.batch.device_us,
            offsets=packet.batch.offsets,
            quat=quat,
        )
        yield Outgoing(packet.due_s, batch, packet.times_s)


def led_away(stream: NodeStream, of: Wearer, from_s: float, by_deg: float) -> Iterator[Outgoing]:
    """Yield a node's raw packets, the field that it measures turned about the vertical from `from_s` on."""
    for packet in stream.packets:
        mag = packet.batch.mag
        if mag is None or packet.times_s[0] < from_s:
            yield packet
            continue
        attitude = of.truth(packet.times_s, "right").world_from_sensor[stream.segment]
        field = rotation.rotate(attitude, np.frombuffer(mag, "<f4").reshape(-1, 3).astype(np.float64))
        turned = rotation.rotate(rotation.about(2, np.radians(by_deg)), field)
        block = rotation.rotate(rotation.inverse(attitude), turned).astype("<f4").tobytes()
        yield replace(packet, batch=msgspec.structs.replace(packet.batch, mag=block))


def stream_of(
    subject: str, segment: str, *, turned: bool, jump_s: float | None, jump_deg: float
) -> NodeStream:
    """Return one node."""
    of = wearer((segment,))
    (stream,) = node_streams(subject, of, FaultSettings(), boot=1)
    if not turned:
        if jump_s is not None:
            stream = replace(stream, packets=led_away(stream, of, jump_s, jump_deg))
        return stream
    hello = msgspec.structs.replace(
        stream.hello, orientation_only=True, magnetometer=False, chip="orientation"
    )
    packets = orientations(stream, of, jump_s, jump_deg)
    return NodeStream(
        subject=subject,
        segment=segment,
        hello=hello,
        mounting=stream.mounting,
        packets=packets,
        clock_us=stream.clock_us,
    )


async def _wear(args: argparse.Namespace, bus: Bus, stop: threading.Event) -> None:
    timeline = Appointed(args.start_ns)
    stream = stream_of(
        args.subject, args.segment, turned=args.turned, jump_s=args.jump_s, jump_deg=args.jump_deg
    )
    sink = SocketSink(args.gateway, args.token, stream, timeline)

    async def beside() -> None:
        if not args.truth:
            return
        clock = await asyncio.to_thread(follow_host_time, bus, args.room, sink.host or "gateway")
        origin_ns = clock.at(timeline.start_ns)
        truth = wearer().skeleton_stream("right", origin_ns, origin_ns, TRUTH_NS)
        for tick in itertools.count():
            if not await timeline.reach(tick * TRUTH_NS * 1e-9, stop):
                return
            bus.put(keys.truth(args.room, args.subject, "right"), encode(next(truth)))

    await send_streams([(stream, sink)], timeline, args.seconds, stop, beside)


def main() -> None:
    """Wear one sensor until the end, or until killed."""
    parser = argparse.ArgumentParser()
    for name in ("--endpoint", "--room", "--gateway", "--token", "--subject", "--segment"):
        parser.add_argument(name, required=True)
    parser.add_argument("--start-ns", type=int, required=True)
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--turned", action="store_true")
    parser.add_argument("--jump-s", type=float)
    parser.add_argument("--jump-deg", type=float, default=0.0)
    parser.add_argument("--truth", action="store_true")
    args = parser.parse_args()
    logging.basicConfig(level=logging.WARNING)
    stop = stop_on_signals()
    with Bus.open(args.endpoint, stop=stop) as bus:
        asyncio.run(_wear(args, bus, stop))


if __name__ == "__main__":
    main()
