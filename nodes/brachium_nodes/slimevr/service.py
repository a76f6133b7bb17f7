"""The door for SlimeVR trackers: their datagrams come in by UDP, their orientations go out on the bus."""

import asyncio
import logging
import threading
from collections.abc import Callable
from dataclasses import dataclass

from brachium_nodes.assign_command import serve_assign
from brachium_nodes.discovery import broadcast_address
from brachium_nodes.host_claim import HostClaims, checked_host
from brachium_nodes.listening import BadAddress, CannotListen, listening_address, why_not
from brachium_nodes.roster import SLIMEVR, Roster
from brachium_nodes.shown_infos import ShownInfos
from brachium_nodes.slimevr.actions import Action, Joined, Left, Publish, Send, Told
from brachium_nodes.slimevr.allowed import Allowed, AllowList, from_node
from brachium_nodes.slimevr.tracker import Address
from brachium_nodes.slimevr.trackers import NO_TOKEN, Trackers
from brachium_wire import keys
from brachium_wire.bus import DEFAULT_ENDPOINT, Bus
from brachium_wire.codec import encode
from brachium_wire.heart import Heart
from brachium_wire.hosttime import HostClock, tell_host_time
from brachium_wire.messages import Info, Quaternion

log = logging.getLogger(__name__)

PORT = 6969
"""Where trackers seek their server."""
LOOK_S = 0.01


@dataclass(frozen=True, kw_only=True)
class SlimeVRSettings:
    """One door for SlimeVR trackers."""

    endpoint: str = DEFAULT_ENDPOINT
    room: str = keys.DEFAULT_ROOM
    id: str = "slimevr"
    """Names the service and its clock: `info.host` of its trackers."""
    bind: str = "127.0.0.1"
    port: int = PORT
    """0 takes any free port; the health's text says which."""
    trackers: tuple[Allowed, ...] = ()
    """Who is answered. Everyone else waits."""


def run(settings: SlimeVRSettings, stop: threading.Event) -> None:
    """Serve trackers until `stop` is set. Raises CannotListen, ValueError or NoRouter, each one line."""
    address = listening_address(settings.bind)
    if ":" in address:
        raise BadAddress(f"--bind {address}: trackers speak IPv4 only; give the IPv4 address of an interface")
    checked_host(settings.id)
    allowed = AllowList(settings.trackers)
    with Bus.open(settings.endpoint, stop=stop) as bus:
        asyncio.run(Service(bus, settings, allowed).serve(address, stop))


class Service:
    """Joins socket, rules and bus. All of it runs on one event loop."""

    def __init__(self, bus: Bus, settings: SlimeVRSettings, allowed: AllowList) -> None:
        self._bus, self._settings = bus, settings
        self._clock = HostClock()
        self._claims = HostClaims(bus, settings.room, settings.id)
        self._roster = Roster((), NO_TOKEN)
        self._trackers = Trackers(allowed, self._roster, settings.id, self._claims.other)
        self._tokens: dict[str, Callable[[], None]] = {}
        self._infos = ShownInfos(bus, settings.room, self._roster)

    async def serve(self, address: str, stop: threading.Event) -> None:
        """Listen until `stop` is set."""
        settings, loop = self._settings, asyncio.get_running_loop()
        try:
            way, _ = await loop.create_datagram_endpoint(
                lambda: _Door(self._received), local_addr=(address, settings.port)
            )
        except OSError as error:
            raise CannotListen(why_not(error, address, settings.port)) from None
        self._way = way
        port = way.get_extra_info("sockname")[1]
        heard = await self._hear_broadcasts(address, port)
        self._heart = Heart(self._bus, settings.room, "slimevr", settings.id)
        self._heart.text = f"udp {address}:{port}"
        tell_host_time(self._bus, settings.room, settings.id, self._clock.now_ns)
        serve_assign(self._bus, settings.room, loop, lambda node: node.startswith(SLIMEVR), self._assign)
        log.info("SlimeVR trackers may come in at %s", self._heart.text)
        self._beat(now=True)
        try:
            while not stop.is_set():
                await asyncio.sleep(LOOK_S)
                self._do(self._trackers.tick(self._clock.now_ns()))
                self._give_way()
                self._beat()
            self._do(self._trackers.expel(self._clock.now_ns(), "the service ends"))
        finally:
            for transport in (way, heard):
                if transport is not None:
                    transport.close()
        self._beat(now=True)
        log.info("%s ended", settings.id)

    async def _hear_broadcasts(self, address: str, port: int) -> asyncio.BaseTransport | None:
        """Return the socket on which trackers that seek a server are heard; where it cannot be had, None."""
        try:
            heard, _ = await asyncio.get_running_loop().create_datagram_endpoint(
                lambda: _Door(self._received),
                local_addr=(broadcast_address(address), port),
                allow_broadcast=True,
            )
        except OSError as error:
            log.warning(
                "trackers that seek a server by broadcast are not heard (%s): tell them %s", error, address
            )
            return None
        return heard

    def _received(self, data: bytes, address: Address) -> None:
        self._do(self._trackers.receive(data, address, self._clock.now_ns()))

    def _do(self, actions: list[Action]) -> None:
        for action in actions:
            match action:
                case Send(address, data):
                    self._way.sendto(data, address)
                case Publish():
                    self._publish(action)
                case Joined(node, subject, segment):
                    self._claims.claim(subject)
                    self._tokens[node] = self._bus.announce(keys.alive(self._settings.room, "node", node))
                    log.info("tracker %s joined as %s of %s", node, segment, subject)
                case Left(node, subject, reason):
                    self._tokens.pop(node)()
                    if subject not in self._trackers.subjects:
                        self._claims.release(subject)
                    self._infos.forget(node)
                    log.info("tracker %s left: %s", node, reason)
                case Told(text):
                    log.warning("%s", text)

    def _publish(self, action: Publish) -> None:
        room, subject, segment, payload = (
            self._settings.room,
            action.subject,
            action.segment,
            encode(action.message),
        )
        match action.topic:
            case "info":
                assert isinstance(action.message, Info)
                self._infos.show(subject, segment, action.message)
            case "imu":
                self._heart.counts["batches"] += 1
                self._bus.put(keys.imu(room, subject, segment), payload)
            case "status":
                self._bus.put(keys.status(room, subject, segment), payload)
            case "event":
                self._bus.put(keys.event(room, subject), payload)

    def _give_way(self) -> None:
        for subject in self._trackers.subjects:
            if self._claims.yields(subject):
                reason = f"{subject} comes in through host {self._claims.other(subject)}"
                self._do(self._trackers.expel(self._clock.now_ns(), reason, subject=subject))

    def _beat(self, *, now: bool = False) -> None:
        heart, trackers = self._heart, self._trackers
        heart.waiting, heart.drops = self._roster.waiting, trackers.drops
        heart.counts.update({name: n - heart.counts[name] for name, n in trackers.counts.items()})
        heart.counts["trackers"] = trackers.connected
        heart.beat(now=now)

    def _assign(self, node: str, subject: str, segment: str, mounting: Quaternion | None) -> str:
        """Assign a sensor of a tracker; return "" or the reason why not."""
        try:
            self._trackers.allowed.add(from_node(node, subject, segment, mounting))
        except ValueError as error:
            return str(error)
        log.warning("%s is now %s of %s; put it into the site file to keep it", node, segment, subject)
        self._do(self._trackers.reassign(node, self._clock.now_ns()))
        self._beat(now=True)
        return ""


class _Door(asyncio.DatagramProtocol):
    def __init__(self, received: Callable[[bytes, Address], None]) -> None:
        self._received = received

    def datagram_received(self, data: bytes, addr: tuple[str | int, ...]) -> None:
        """Hand a datagram on."""
        try:
            self._received(data, (str(addr[0]), int(addr[1])))
        except Exception:  # the loop would only log it in its own words
            log.exception("a datagram of %s could not be handled", addr[0])
