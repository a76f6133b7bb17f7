"""Sensor calibrations that were fitted before, by node: for nodes that bring none."""

import logging
from collections.abc import Callable
from pathlib import Path

from brachium_wire.calibration_file import CalibrationFileError, path_of, read
from brachium_wire.messages import SensorCalibration

log = logging.getLogger(__name__)

NONE = SensorCalibration()


def calibrations_in(folder: Path | None) -> Callable[[str], SensorCalibration]:
    """Return what looks a node's calibration up whenever it joins, so that a new fit needs no restart.

    What a file has wrong is logged, and the node goes uncalibrated.
    """

    def look(node: str) -> SensorCalibration:
        if folder is None:
            return NONE
        try:
            return read(path_of(folder, node)).calibration
        except FileNotFoundError:
            return NONE
        except (CalibrationFileError, OSError) as error:
            log.warning("node %s goes uncalibrated: %s", node, error)
            return NONE

    return look
