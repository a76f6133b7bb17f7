"""`brachium can`: one CAN interface, sensors in, joint angles out, or both. One thread does it all."""

import logging
import threading
import time
from dataclasses import dataclass, field
from pathlib import Path

from brachium_nodes.can.arm_sender import ArmSender
from brachium_nodes.can.imus import CanImus
from brachium_nodes.can.joint_table import JointTable, read_joints
from brachium_nodes.can.port import Port, PortSettings
from brachium_nodes.can.sensor_map import CanSensor, read_sensors
from brachium_nodes.host_claim import checked_host
from brachium_wire import keys
from brachium_wire.bus import DEFAULT_ENDPOINT, Bus
from brachium_wire.heart import BEAT_S, Heart
from brachium_wire.hosttime import HostClock, tell_host_time
from brachium_wire.messages import Origin

log = logging.getLogger(__name__)

LOOK_S = 0.01
"""How often it is looked what time asks for; and how fast a stop is seen."""


@dataclass(frozen=True, kw_only=True)
class CanSettings:
    """One CAN interface and what it is for: sensors, a joint table, or both."""

    endpoint: str = DEFAULT_ENDPOINT
    room: str = keys.DEFAULT_ROOM
    id: str = "can"
    """Names the service and its clock: `info.host` of its sensors."""
    port: PortSettings = field(default_factory=PortSettings)
    sensors: Path | None = None
    """The sensor table: what comes in."""
    dbc: Path | None = None
    """In place of the DBC that the sensors' maps name."""
    batch: int = 5
    """Samples in a packet on the network."""
    calibrations: Path | None = None
    joints: Path | None = None
    """The machine maker's table: what goes out."""
    origins: frozenset[Origin] = frozenset({"worn"})
    """Whose samples a machine may take for valid."""


def run(settings: CanSettings, stop: threading.Event) -> None:
    """Serve until `stop` is set.

    Raises BadMap, FileNotFoundError, NoInterface, NoRouter, OtherSender, each with one line;
    ModuleNotFoundError without the extra `can`.
    """
    checked_host(settings.id)
    sensors = () if settings.sensors is None else read_sensors(settings.sensors, settings.dbc)
    table = None if settings.joints is None else read_joints(settings.joints)
    port = Port(settings.port)
    try:
        with Bus.open(settings.endpoint, stop=stop, timeout_s=None) as bus:
            _Service(settings, bus, port, sensors, table).run(stop)
    finally:
        port.close()


class _Service:
    def __init__(
        self,
        settings: CanSettings,
        bus: Bus,
        port: Port,
        sensors: tuple[CanSensor, ...],
        table: JointTable | None,
    ) -> None:
        self._clock, self._port = HostClock(), port
        self._heart = Heart(bus, settings.room, "can", settings.id)
        self._heart.text = port.name
        self._imus: CanImus | None = None
        if sensors:
            tell_host_time(bus, settings.room, settings.id, self._clock.now_ns)
            self._imus = CanImus(
                bus, settings.room, settings.id, sensors, settings.batch, settings.calibrations
            )

        self._sender: ArmSender | None = None
        self._send_s = self._beat_s = 0.0
        self._looked_ns = self._clock.now_ns()
        if table is not None:
            self._sender = ArmSender(
                bus, settings.room, table, settings.origins, fd=settings.port.fd, echoes=port.echoes
            )
            self._send_s = 1.0 / table.rate_hz

    def run(self, stop: threading.Event) -> None:
        """Take frames as they come; look after everything else at its time. Raises OtherSender."""
        try:
            self._serve(stop)
        finally:
            self._end()

    def _serve(self, stop: threading.Event) -> None:
        receive = self._port.receive
        taken = (lambda _number, _data, _now_ns: None) if self._imus is None else self._imus.receive
        sender = self._sender
        host_ns = self._clock.at(0)
        look_s = send_s = due_s = now_s = time.monotonic()
        while not stop.is_set():
            frame = receive(due_s - now_s)
            now_ns = time.monotonic_ns()
            if frame is not None:
                if sender is not None:
                    sender.hear(*frame)
                taken(frame[0], frame[1], host_ns + now_ns)
            now_s = 1e-9 * now_ns
            if now_s < due_s:
                continue
            if sender is not None and now_s >= send_s:
                sender.tick(self._port)
                send_s = max(send_s + self._send_s, now_s)  # late frames are left out, not caught up
            if now_s >= look_s:
                look_s = now_s + LOOK_S
                self._look()
            due_s = look_s if sender is None else min(look_s, send_s)
            now_s = min(time.monotonic(), due_s)

    def _look(self) -> None:
        # What came before the last look has been read by now. After a hold-up of this thread the rest of a
        # sample may still lie in the interface: it is not late.
        read_ns, self._looked_ns = self._looked_ns, self._clock.now_ns()
        if self._imus is not None:
            self._imus.tick(read_ns)
        if time.monotonic() >= self._beat_s:
            self._beat()

    def _end(self) -> None:
        if self._imus is not None:
            self._imus.close(self._clock.now_ns())
        if self._sender is not None:
            self._sender.close()
        self._beat()

    def _beat(self) -> None:
        self._beat_s = time.monotonic() + BEAT_S
        heart = self._heart
        for part in (self._port, self._imus, self._sender):
            if part is not None:
                heart.counts |= part.counts
                if not isinstance(part, Port):
                    heart.drops |= part.drops
        heart.beat(now=True)
