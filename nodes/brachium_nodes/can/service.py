"""`brachium can`: one CAN interface, sensors in, joint angles out, or both. One thread does it all."""

import logging
import threading
import time
from dataclasses import dataclass, field
from pathlib import Path

from brachium_nodes.can.imus import CanImus
from brachium_nodes.can.port import Port, PortSettings
from brachium_nodes.can.sensor_map import CanSensor, read_sensors
from brachium_nodes.host_claim import checked_host
from brachium_nodes.known_calibrations import calibrations_in
from brachium_wire import keys
from brachium_wire.bus import DEFAULT_ENDPOINT, Bus
from brachium_wire.heart import Heart
from brachium_wire.hosttime import HostClock, tell_host_time

log = logging.getLogger(__name__)

LOOK_S = 0.01
"""Longest wait for a frame: the timer of what is sent, and how fast a stop is seen."""


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


def run(settings: CanSettings, stop: threading.Event) -> None:
    """Serve until `stop` is set.

    Raises BadMap, FileNotFoundError, NoInterface, NoRouter, each with one line; ModuleNotFoundError without
    the extra `can`.
    """
    checked_host(settings.id)
    sensors = () if settings.sensors is None else read_sensors(settings.sensors, settings.dbc)
    with Bus.open(settings.endpoint, stop=stop) as bus:
        port = Port(settings.port)
        try:
            _Service(settings, bus, port, sensors).run(stop)
        finally:
            port.close()


class _Service:
    def __init__(self, settings: CanSettings, bus: Bus, port: Port, sensors: tuple[CanSensor, ...]) -> None:
        self._clock, self._port = HostClock(), port
        self._heart = Heart(bus, settings.room, "can", settings.id)
        self._heart.text = port.name
        self._imus: CanImus | None = None
        if sensors:
            tell_host_time(bus, settings.room, settings.id, self._clock.now_ns)
            known = calibrations_in(settings.calibrations)
            self._imus = CanImus(bus, settings.room, settings.id, sensors, settings.batch, known)

    def run(self, stop: threading.Event) -> None:
        due_s = time.monotonic()
        while not stop.is_set():
            wait_s = due_s - time.monotonic()
            frame = self._port.receive(min(max(wait_s, 0.0), LOOK_S))
            if frame is not None and self._imus is not None:
                self._imus.receive(*frame, self._clock.now_ns())
            if time.monotonic() >= due_s:
                due_s = max(due_s + LOOK_S, time.monotonic())
                self._tick()
        if self._imus is not None:
            self._imus.close(self._clock.now_ns())
        self._beat(now=True)

    def _tick(self) -> None:
        if self._imus is not None:
            self._imus.tick(self._clock.now_ns())
        self._beat()

    def _beat(self, *, now: bool = False) -> None:
        heart = self._heart
        heart.counts.update({k: n - heart.counts[k] for k, n in self._port.counts.items()})
        if self._imus is not None:
            heart.counts.update({k: n - heart.counts[k] for k, n in self._imus.counts.items()})
            heart.drops.update({k: n - heart.drops[k] for k, n in self._imus.drops.items()})
        heart.beat(now=now)
