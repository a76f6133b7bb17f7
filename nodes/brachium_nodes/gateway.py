"""The gateway: nodes come in by WebSocket, their samples go out on the bus with host time."""

import asyncio
import hashlib
import logging
import threading
from collections.abc import Callable
from contextlib import AsyncExitStack
from dataclasses import dataclass
from http import HTTPStatus
from pathlib import Path

from websockets.http11 import Request

from brachium_nodes.assign_command import serve_assign
from brachium_nodes.battery_watch import BatteryWatch
from brachium_nodes.connection import Connection
from brachium_nodes.conversation import Conversation
from brachium_nodes.discovery import answer_seekers
from brachium_nodes.host_claim import HostClaims, checked_host
from brachium_nodes.known_calibrations import CalibrationNews, KnownCalibrations
from brachium_nodes.listening import CannotListen, listening_address, why_not
from brachium_nodes.node_door import listening
from brachium_nodes.node_frames import MAX_FRAME_BYTES, Hello
from brachium_nodes.node_socket import House, NodeSocket
from brachium_nodes.paced_loop import paced_loop
from brachium_nodes.roster import SLIMEVR, Admission, NodeEntry, Refusal, Roster
from brachium_nodes.shown_infos import ShownInfos
from brachium_wire import keys
from brachium_wire.bus import DEFAULT_ENDPOINT, Bus
from brachium_wire.codec import encode
from brachium_wire.heart import Heart
from brachium_wire.hosttime import HostClock, tell_host_time
from brachium_wire.messages import Info, Message, Quaternion, SampleBatch, Status

log = logging.getLogger(__name__)

PATH = "/node"
TICK_S = 0.05


@dataclass(frozen=True, kw_only=True)
class GatewaySettings:
    """One gateway. Every node needs a token; there is no way in without."""

    endpoint: str = DEFAULT_ENDPOINT
    room: str = keys.DEFAULT_ROOM
    id: str = "gateway"
    """Names the service and its clock: `info.host` of its nodes."""
    bind: str = "127.0.0.1"
    port: int = 8765
    """0 takes any free port; the health's text says which."""
    discovery_port: int | None = None
    """Where nodes that do not know the gateway's address are heard, by UDP; None: nowhere."""
    nodes: tuple[NodeEntry, ...] = ()
    join_token_sha256: str | None = None
    """A token with which new nodes may knock; they wait until they are assigned."""
    calibrations: Path | None = None
    """Folder of sensor calibrations, one file a node: for nodes that bring none of their own. What is found
    while the gateway runs is kept there too."""


def token_sha256(token: str) -> str:
    """Return what the node table keeps of a token."""
    return hashlib.sha256(token.encode()).hexdigest()


def run(settings: GatewaySettings, stop: threading.Event) -> None:
    """Serve nodes until `stop` is set. Raises CannotListen, BadKey, ValueError or NoRouter, each one line."""
    address = listening_address(settings.bind)
    checked_host(settings.id)
    known = KnownCalibrations(settings.calibrations)
    roster = Roster(settings.nodes, settings.join_token_sha256, known.of)
    with Bus.open(settings.endpoint, stop=stop) as bus, asyncio.Runner(loop_factory=paced_loop) as runner:
        runner.run(Gateway(bus, settings, roster, known).serve(address, stop))


class Gateway:
    """Joins connections, roster and bus. All of it runs on one event loop."""

    def __init__(self, bus: Bus, settings: GatewaySettings, roster: Roster, known: KnownCalibrations) -> None:
        self._bus, self._settings, self._roster, self._known = bus, settings, roster, known
        self._calibrated = CalibrationNews(bus, settings.room, known)
        self._clock = HostClock()
        self._claims = HostClaims(bus, settings.room, settings.id)
        self._connections: dict[str, Connection] = {}
        self._tokens: dict[str, Callable[[], None]] = {}
        self._open: set[Connection] = set()
        self._batteries = BatteryWatch()
        self._infos = ShownInfos(bus, settings.room, roster)

    async def serve(self, address: str, stop: threading.Event) -> None:
        """Listen until `stop` is set."""
        settings, loop = self._settings, asyncio.get_running_loop()
        house = House(door=self._door, opened=self._join, broken=self._broken, max_bytes=MAX_FRAME_BYTES)
        async with AsyncExitStack() as stack:
            try:
                port = await stack.enter_async_context(listening(house, address, settings.port))
            except OSError as error:
                raise CannotListen(why_not(error, address, settings.port)) from None
            self._heart = Heart(self._bus, settings.room, "gateway", settings.id)
            self._heart.text = f"ws://{f'[{address}]' if ':' in address else address}:{port}{PATH}"
            tell_host_time(self._bus, settings.room, settings.id, self._clock.now_ns)
            serve_assign(
                self._bus, settings.room, loop, lambda node: not node.startswith(SLIMEVR), self._assign
            )
            log.info("gateway %s takes nodes at %s", settings.id, self._heart.text)
            async with answer_seekers(
                address, settings.discovery_port, self._heart.text, self._roster.token_of
            ):
                self._beat(now=True)
                while not stop.is_set():
                    await asyncio.sleep(TICK_S)
                    self._tick(loop.time())
                    self._beat()
                    self._give_way()
                    self._bring_calibrations()
        self._beat(now=True)
        log.info("gateway %s ended", settings.id)

    def _door(self, request: Request) -> tuple[HTTPStatus, str] | None:
        if request.path != PATH:
            return HTTPStatus.NOT_FOUND, f"nodes connect to {PATH}\n"
        if not self._roster.knows(_presented(request)):
            self._heart.drops["unauthorized"] += 1
            return HTTPStatus.UNAUTHORIZED, "send Authorization: Bearer and this node's token\n"
        return None

    def _broken(self, name: str) -> None:
        self._heart.drops[name] += 1

    def _join(self, socket: NodeSocket, request: Request) -> None:
        token = _presented(request)

        def admit(hello: Hello) -> Admission | Refusal:
            return self._admit(hello, token, connection)

        conversation = Conversation(admit, self._settings.id, self._clock.now_ns())
        connection = Connection(socket, conversation, self._clock, self._publish, self._left)
        self._open.add(connection)

    def _tick(self, now_s: float) -> None:
        now_ns = self._clock.now_ns()
        for connection in [c for c in self._open if c.conversation.due_ns <= now_ns]:
            connection.tick(now_s)

    def _admit(self, hello: Hello, token: str, connection: Connection) -> Admission | Refusal:
        subject = self._roster.subject_of(hello.node)
        other = self._claims.other(subject) if subject is not None else None
        answer = self._roster.admit(hello, token, other)
        if isinstance(answer, Refusal):
            self._heart.counts["refused"] += 1
            log.info("node %r refused: %r", hello.node[:64], answer.reason)
            return answer
        if answer.replaces:
            old = self._connections[hello.node]
            old.replaced = True
            self._expel(old, Refusal("replaced", f"a newer connection of node {hello.node} took over"))
        self._connections[hello.node] = connection
        self._claims.claim(answer.subject)
        if hello.node not in self._tokens:
            key = keys.alive(self._settings.room, "node", hello.node)
            self._tokens[hello.node] = self._bus.announce(key)
        log.info("node %s joined as %s of %s", hello.node, answer.segment, answer.subject)
        return answer

    def _left(self, connection: Connection) -> None:
        self._open.discard(connection)
        hello, admission = connection.conversation.hello, connection.conversation.admission
        if (refused := connection.conversation.refused) is not None and refused.code == "bad_hello":
            self._heart.drops["bad_hello"] += 1
        if hello is None or admission is None or self._connections.get(hello.node) is not connection:
            return
        del self._connections[hello.node]
        self._roster.leave(hello.node)
        self._tokens.pop(hello.node)()
        if admission.subject not in self._subjects():
            self._claims.release(admission.subject)
        self._infos.forget(hello.node)
        log.info("node %s left", hello.node)

    def _publish(self, admission: Admission, topic: str, message: Message) -> None:
        room, subject, segment = self._settings.room, admission.subject, admission.segment
        if topic == "imu":
            assert isinstance(message, SampleBatch)
            self._heart.counts["batches"] += 1
            self._heart.counts["samples"] += len(message.offsets) // 4
            self._bus.put(keys.imu(room, subject, segment), encode(message))
        elif topic == "info":
            assert isinstance(message, Info)
            self._known.told(message)
            self._infos.show(subject, segment, message)
        else:
            assert isinstance(message, Status)
            self._batteries.look(message)
            self._bus.put(keys.status(room, subject, segment), encode(message))

    def _bring_calibrations(self) -> None:
        """Tell nodes that are there what fusion found of their sensors; others get it when they come."""
        for node, calibration in self._calibrated.drain().items():
            connection = self._connections.get(node)
            if connection is not None:
                connection.do(connection.conversation.keep(calibration))

    def _expel(self, connection: Connection, refusal: Refusal) -> None:
        # In a turn of its own: who takes over is there before the old one leaves.
        asyncio.get_running_loop().call_soon(connection.do, connection.conversation.expel(refusal))

    def _give_way(self) -> None:
        for subject in self._subjects():
            if self._claims.yields(subject):
                text = f"{subject} comes in through host {self._claims.other(subject)}"
                for connection in list(self._connections.values()):
                    if connection.conversation.subject == subject:
                        self._expel(connection, Refusal("second_host", text, 5.0))

    def _subjects(self) -> set[str]:
        return {s for c in self._connections.values() if (s := c.conversation.subject) is not None}

    def _beat(self, *, now: bool = False) -> None:
        self._heart.waiting = self._roster.waiting
        self._heart.counts["nodes"] = len(self._connections)
        self._heart.beat(now=now)

    def _assign(self, node: str, subject: str, segment: str, mounting: Quaternion | None) -> str:
        """Assign a node; return "" or the reason why not."""
        reason = self._roster.assign(node, subject, segment, mounting)
        if reason:
            return reason
        log.warning("node %r is now %s of %s; put it into the site file to keep it", node, segment, subject)
        connection = self._connections.get(node)
        if connection is not None:
            self._expel(connection, Refusal("reassigned", f"assigned to {segment} of {subject}", 0.0))
        else:
            self._infos.forget(node)
        self._beat(now=True)
        return ""


def _presented(request: Request) -> str:
    """Return the SHA-256 of the bearer token of a request."""
    kind, _, token = request.headers.get("Authorization", "").partition(" ")
    return token_sha256(token.strip() if kind.lower() == "bearer" else "")
