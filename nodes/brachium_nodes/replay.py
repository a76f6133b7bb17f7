"""A recording put on the bus again: messages keep their bytes, only info says that it is playback."""

from collections.abc import Callable
from pathlib import Path

import msgspec

from brachium_nodes.direct_node import DirectHost
from brachium_nodes.node_client import NotWelcome
from brachium_nodes.node_stream import Stop, StreamCount, Timeline
from brachium_wire import keys, recording
from brachium_wire.bus import Bus
from brachium_wire.codec import WireError, decode_topic, encode
from brachium_wire.heart import Heart
from brachium_wire.messages import Info, SampleBatch, Status
from brachium_wire.sequence import SequenceCounter

Place = tuple[str, str]


class _Replay:
    """What was played so far."""

    def __init__(self, host: DirectHost, heart: Heart) -> None:
        self.host, self._heart = host, heart
        self._nodes: dict[Place, str] = {}
        self._ends: list[Callable[[], None]] = []
        self._counters: dict[Place, SequenceCounter] = {}

    def play(self, where: keys.Key, payload: bytes) -> None:
        """Put one recorded message on the bus."""
        bus, room, place = self.host.bus, self.host.room, (where.subject, where.detail)
        if where.topic == "info":
            self._join(place, decode_topic(payload, "info"))
        elif where.topic == "session":
            bus.retain(keys.session(room, where.subject), payload)
        elif where.topic == "imu" and place in self._nodes:
            batch = decode_topic(payload, "imu")
            assert isinstance(batch, SampleBatch)
            counter = self._counters.setdefault(place, SequenceCounter())
            counter.feed(batch.sequence, len(batch.offsets) // 4)
            self._heart.counts["batches"] += 1
            bus.put(keys.imu(room, *place), payload)
        elif where.topic == "event":
            bus.put(keys.event(room, where.subject), payload)
        elif where.topic == "status":
            bus.put(keys.status(room, *place), payload)
        elif where.topic == "truth":
            bus.put(keys.truth(room, *place), payload)

    def end(self) -> dict[Place, StreamCount]:
        """Say that the nodes are gone; return what was played."""
        host, counts = self.host, {}
        for place, node in self._nodes.items():
            counter = self._counters.setdefault(place, SequenceCounter())
            status = Status(
                node=node,
                time_ns=host.now_ns(),
                connected=False,
                received=counter.received,
                lost=counter.lost,
                out_of_order=counter.out_of_order,
            )
            host.bus.put(keys.status(host.room, *place), encode(status))
            counts[place] = StreamCount(
                sent=counter.received,
                lost=counter.lost,
                swapped=counter.out_of_order,
                duplicated=counter.repeated,
                next_sequence=counter.next or 0,
            )
        for end in self._ends:
            end()
        return counts

    def _join(self, place: Place, info: object) -> None:
        assert isinstance(info, Info)
        host = self.host
        if place not in self._nodes:
            other = host.claims.other(place[0])
            if other is not None:
                text = f"{place[0]} comes in through host {other}; end that one first"
                raise NotWelcome("second_host", text, None)
            host.claims.claim(place[0])
        if info.node not in self._nodes.values():
            self._ends.append(host.bus.announce(keys.alive(host.room, "node", info.node)))
        self._nodes[place] = info.node
        shown = msgspec.structs.replace(info, origin="playback", host=host.host)
        host.bus.retain(keys.info(host.room, *place), encode(shown))


def replay(
    path: Path, bus: Bus, room: str, host_id: str, timeline: Timeline, end_s: float, stop: Stop, heart: Heart
) -> dict[Place, StreamCount]:
    """Play a recording until its end, until `end_s` after its first batch, or until `stop` is set.

    Host time is the recorded one. Raises NotWelcome when a subject comes in elsewhere, and RecordingError.
    """
    playing: _Replay | None = None
    before: list[tuple[keys.Key, bytes]] = []
    first_log_ns = 0
    with recording.read(path) as messages:
        for key, payload, log_ns in messages:
            where = keys.parse(key)
            if playing is None:
                before.append((where, payload))
                if where.topic != "imu":
                    continue
                first_log_ns = log_ns
                timeline.start()
                host = DirectHost(bus, room, host_id, timeline, _received_ns(payload))
                playing = _Replay(host, heart)
                _play_all(playing, before, heart)
                continue
            due_s = (log_ns - first_log_ns) * 1e-9
            if due_s > end_s or not _reach(timeline, due_s, stop, heart):
                break
            _play_all(playing, [(where, payload)], heart)
    if playing is None:
        raise recording.RecordingError(f"{path}: holds no sensor batch; there is nothing to play")
    return playing.end()


def _play_all(playing: _Replay, messages: list[tuple[keys.Key, bytes]], heart: Heart) -> None:
    for where, payload in messages:
        try:
            playing.play(where, payload)
        except WireError as error:
            heart.drops[error.drop.value] += 1


def _reach(timeline: Timeline, due_s: float, stop: Stop, heart: Heart) -> bool:
    """Wait until source time `due_s`; return False when `stop` came first."""
    while not stop.is_set():
        heart.beat()
        wait_s = (due_s - timeline.now_s()) / timeline.speed
        if wait_s <= 0.0:
            return True
        stop.wait(min(wait_s, 0.5))
    return False


def _received_ns(payload: bytes) -> int:
    batch = decode_topic(payload, "imu")
    assert isinstance(batch, SampleBatch)
    return batch.received_ns
