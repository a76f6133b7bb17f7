"""Warns once of each node whose battery runs low."""

import logging

from brachium_wire.battery import is_low
from brachium_wire.messages import Status

log = logging.getLogger(__name__)


class BatteryWatch:
    """Remembers of whom it warned until that node has a better cell."""

    def __init__(self) -> None:
        self._low: set[str] = set()

    def look(self, status: Status) -> None:
        """Take what a node says of itself."""
        hours = status.battery_hours
        if hours is None or not is_low(hours):
            self._low -= {status.node} if hours is not None and hours > 1.0 else set()
        elif status.node not in self._low:
            self._low.add(status.node)
            log.warning("node %s: low battery, %.0f min left: change the cell", status.node, 60.0 * hours)
