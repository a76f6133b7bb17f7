"""The node's Wi-Fi."""

import asyncio

import network

_LOOK_MS = 250
_JOIN_MS = 15000


class Radio:
    """The node's Wi-Fi; with an empty name whatever network is there is used."""

    def __init__(self, name, password):
        self._name, self._password = name, password
        self._station = network.WLAN(network.STA_IF)

    async def join(self):
        """Return once there is a network. Raises OSError when there is none after 15 s."""
        station = self._station
        if station.isconnected() or not self._name:
            return
        station.active(False)
        station.active(True)
        station.connect(self._name, self._password)
        for _ in range(_JOIN_MS // _LOOK_MS):
            if station.isconnected():
                return
            await asyncio.sleep_ms(_LOOK_MS)
        raise OSError("the Wi-Fi %r does not let this node in" % self._name)

    def signal_dbm(self):
        """Return the signal's strength, or None when it is not known."""
        try:
            return self._station.status("rssi")
        except (OSError, ValueError, TypeError):
            return None
