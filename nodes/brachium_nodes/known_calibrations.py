"""Sensor calibrations that nodes do not have yet: found in this room just now, or kept in a folder.

What fusion found stands on the retained topic `calibration`, by node, and is brought to the node; a node that
is not there gets it when it comes back. With a folder, each is kept there too, one file a node, and outlives
both programs.
"""

import logging
from datetime import UTC, datetime
from pathlib import Path

import msgspec

from brachium_wire import calibration_file as file
from brachium_wire import keys
from brachium_wire.bus import Bus
from brachium_wire.codec import WireError, decode_topic
from brachium_wire.messages import Calibration, Info, SensorCalibration

log = logging.getLogger(__name__)

NONE = SensorCalibration()


class KnownCalibrations:
    """What is known of nodes' sensors beside what the nodes bring."""

    def __init__(self, folder: Path | None = None) -> None:
        self._folder = folder
        self._found: dict[str, SensorCalibration] = {}
        self._waiting: dict[str, SensorCalibration] = {}
        """Of what was found, what no node has said to keep."""

    def of(self, node: str, own: SensorCalibration) -> SensorCalibration:
        """Return what holds for a node whose hello brings `own`: what was found since, its own, or a file's.

        The file is read whenever a node joins, so that a new fit needs no restart. What it has wrong is
        logged, and the node goes uncalibrated.
        """
        if node in self._waiting:
            return self._waiting[node]
        return own if own != NONE else self._file(node).calibration

    def hear(self, calibration: Calibration) -> dict[str, SensorCalibration]:
        """Take what fusion tells of a subject; return what is new in it, by node."""
        new = {node: c for node, c in calibration.sensors.items() if self._found.get(node) != c}
        self._found |= new
        self._waiting |= new
        for node, found in new.items():
            self._keep(node, found)
        return new

    def told(self, info: Info) -> None:
        """Take that a node keeps its calibration itself."""
        if info.kept == "node" and self._waiting.get(info.node) == info.calibration:
            del self._waiting[info.node]

    def _file(self, node: str) -> file.CalibrationFile:
        if self._folder is not None:
            try:
                return file.read(file.path_of(self._folder, node))
            except FileNotFoundError:
                pass
            except (file.CalibrationFileError, keys.BadKey, OSError) as error:
                log.warning("node %s goes uncalibrated: %s", node, error)
        return file.CalibrationFile(node=node)

    def _keep(self, node: str, found: SensorCalibration) -> None:
        if self._folder is None:
            return
        kept, date = self._file(node), datetime.now(UTC).isoformat(timespec="seconds")
        for part, names in file.ENTRIES.items():
            values = {name: getattr(found, name) for name in names}
            if any(getattr(kept.calibration, name) != value for name, value in values.items()):
                fit = file.Fit(
                    part=part,
                    method="guided",
                    date=date,
                    source="live",
                    scores={},
                    calibration=SensorCalibration(**values),
                )
                kept = file.with_fit(kept, fit)
        try:
            file.write(file.path_of(self._folder, node), msgspec.structs.replace(kept, node=node))
        except (keys.BadKey, OSError) as error:
            log.warning("node %s: calibration not kept: %s", node, error)


class CalibrationNews:
    """What fusion tells of sensors in a room, as it comes."""

    def __init__(self, bus: Bus, room: str, known: KnownCalibrations) -> None:
        self._known = known
        topic = keys.subjects(room, "calibration")
        self._inbox = bus.subscribe(topic)
        for _, payload in bus.fetch(topic):
            self._hear(payload)

    def drain(self) -> dict[str, SensorCalibration]:
        """Return what was found since the last call, by node."""
        new: dict[str, SensorCalibration] = {}
        for _, payload in self._inbox.drain():
            new |= self._hear(payload)
        return new

    def _hear(self, payload: bytes) -> dict[str, SensorCalibration]:
        try:
            message = decode_topic(payload, "calibration")
        except WireError as error:
            log.warning("a calibration on the bus cannot be used: %s", error)
            return {}
        assert isinstance(message, Calibration)
        return self._known.hear(message)
