"""The infos that a host shows of its nodes, connected or not: one a place, until its node goes elsewhere."""

from brachium_nodes.roster import Roster
from brachium_wire import keys
from brachium_wire.bus import Bus
from brachium_wire.codec import encode
from brachium_wire.messages import Info


class ShownInfos:
    """What one host shows in one room."""

    def __init__(self, bus: Bus, room: str, roster: Roster) -> None:
        self._bus, self._room, self._roster = bus, room, roster
        self._tellers: dict[tuple[str, str], str] = {}

    def show(self, subject: str, segment: str, info: Info) -> None:
        """Show a node's info at its place."""
        self._tellers[subject, segment] = info.node
        self._bus.retain(keys.info(self._room, subject, segment), encode(info))

    def forget(self, node: str) -> None:
        """Show no info any more at a place that a node was assigned away from."""
        for place in [p for p, teller in self._tellers.items() if teller == node]:
            if place != self._roster.place_of(node):
                del self._tellers[place]
                self._bus.forget(keys.info(self._room, *place))
