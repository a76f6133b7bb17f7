"""All sensors of one bus onto the network: who is there, whose host this is, what was not understood."""

import logging
from collections import Counter
from collections.abc import Callable
from pathlib import Path

from brachium_nodes.can.imu import CanImu
from brachium_nodes.can.sensor_map import CanSensor
from brachium_nodes.host_claim import HostClaims
from brachium_nodes.known_calibrations import NONE, CalibrationNews, KnownCalibrations
from brachium_wire import keys
from brachium_wire.bus import Bus
from brachium_wire.codec import encode
from brachium_wire.messages import SampleBatch

log = logging.getLogger(__name__)

STATUS_NS = 1_000_000_000
MAX_STRANGE = 32
"""Ids that are remembered as not understood; a babbling node sends any."""


class CanImus:
    """The sensors of one bus, put on the network while they are heard."""

    def __init__(
        self,
        bus: Bus,
        room: str,
        host: str,
        sensors: tuple[CanSensor, ...],
        batch: int,
        calibrations: Path | None,
    ) -> None:
        """`batch`: samples in a packet; `calibrations`: a folder of sensor calibrations, as the gateway's."""
        self._bus, self._room, self._host = bus, room, host
        self._claims = HostClaims(bus, room, host)
        self._known = KnownCalibrations(calibrations)
        self._news = CalibrationNews(bus, room, self._known)
        self._imus = [CanImu(sensor, batch) for sensor in sensors]
        self._by_id = {
            number: (imu, imu.receiver(message.name))
            for imu in self._imus
            for number, message in imu.sensor.messages.items()
        }
        self._tokens: dict[str, Callable[[], None]] = {}
        self._status_ns = 0
        self.strange: set[int] = set()
        """Ids that no sensor of the table has."""
        self.drops: Counter[str] = Counter()
        self.counts: Counter[str] = Counter()

    def receive(self, number: int, data: bytes | bytearray, now_ns: int) -> None:
        """Take a frame that came at host time `now_ns`; bit 31 of `number` stands for 29 bits."""
        found = self._by_id.get(number)
        if found is None:
            self.drops["unknown_id"] += 1
            if len(self.strange) < MAX_STRANGE:
                self.strange.add(number)
            return
        imu, receive = found
        if receive is not None:
            for batch in receive(data, now_ns):
                self._publish(imu, batch)

    def tick(self, now_ns: int) -> None:
        """Do what time asks for; call it every 10 ms or so."""
        for imu in self._imus:
            for batch in imu.tick(now_ns):
                self._publish(imu, batch)
        if now_ns < self._status_ns:
            return
        self._status_ns = now_ns + STATUS_NS
        fitted = self._news.drain()
        for imu in self._imus:
            sensor = imu.sensor
            if sensor.id in self._tokens:
                if sensor.id in fitted:
                    self._tell(imu)
                self._bus.put(
                    keys.status(self._room, sensor.subject, sensor.segment), encode(imu.status(now_ns))
                )
                if not imu.connected(now_ns) or self._claims.yields(sensor.subject):
                    self._leave(imu)
        self.counts["nodes"] = len(self._tokens)

    def close(self, now_ns: int) -> None:
        """Say that all are gone."""
        for imu in self._imus:
            if imu.sensor.id in self._tokens:
                imu.heard_ns = None
                place = keys.status(self._room, imu.sensor.subject, imu.sensor.segment)
                self._bus.put(place, encode(imu.status(now_ns)))
                self._leave(imu)

    def _publish(self, imu: CanImu, batch: SampleBatch) -> None:
        sensor = imu.sensor
        if sensor.id not in self._tokens and not self._join(imu):
            self.drops["second_host"] += 1
            return
        self.counts["batches"] += 1
        self.counts["samples"] += len(batch.offsets) // 4
        self._bus.put(keys.imu(self._room, sensor.subject, sensor.segment), encode(batch))

    def _join(self, imu: CanImu) -> bool:
        sensor = imu.sensor
        other = self._claims.other(sensor.subject)
        if other is not None:
            if not self.drops["second_host"]:
                log.warning("%s comes in through host %s; end that one first", sensor.subject, other)
            return False
        self._claims.claim(sensor.subject)
        self._tokens[sensor.id] = self._bus.announce(keys.alive(self._room, "node", sensor.id))
        self._tell(imu)
        log.info("sensor %s is heard: %s of %s", sensor.id, sensor.segment, sensor.subject)
        return True

    def _tell(self, imu: CanImu) -> None:
        sensor = imu.sensor
        info = imu.info(self._host, self._known.of(sensor.id, NONE))
        self._bus.retain(keys.info(self._room, sensor.subject, sensor.segment), encode(info))

    def _leave(self, imu: CanImu) -> None:
        sensor = imu.sensor
        self._tokens.pop(sensor.id)()
        if not any(i.sensor.subject == sensor.subject and i.sensor.id in self._tokens for i in self._imus):
            self._claims.release(sensor.subject)
        log.warning("sensor %s is not heard any more", sensor.id)
