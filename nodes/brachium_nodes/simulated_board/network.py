"""Wi-Fi that is always there."""

import board

STA_IF = 0


class WLAN:
    """The station."""

    def __init__(self, interface):
        self._active = True

    def isconnected(self):
        """Return whether there is a network."""
        return self._active

    def active(self, on):
        """Switch it."""
        self._active = on

    def connect(self, name, password):
        """Join."""

    def status(self, what):
        """Return the signal in dBm."""
        return board.SETTINGS["rssi_dbm"]
