"""The cell: its voltage, how much is left of it, and when to stop before it is harmed."""

_CURVE = bytes((0, 0, 20, 5, 30, 13, 40, 35, 50, 57, 60, 72, 70, 84, 85, 100))
# 0.01 V above 3.3 V, and percent of the charge that is left then, under a light load; typical of lithium-ion
# cells, not of one cell.
_CALM = 16
_EMPTY_READINGS = 10


def share_left(volts):
    """Return how much of a cell's charge is left, 0 to 1."""
    above = max(0.0, 100 * volts - 330)
    for at in range(2, len(_CURVE), 2):
        low, left, high, more = _CURVE[at - 2 : at + 2]
        if above < high:
            return (left + (more - left) * (above - low) / (high - low)) / 100
    return 1.0


class Battery:
    """A cell seen by a converter with machine.ADC's read_u16; None where none is wired."""

    def __init__(self, converter, about):
        self._converter, self._full_scale_v = converter, about["full_scale_v"]
        self._hours, self._empty_v = about["capacity_mah"] / about["current_ma"], about["empty_v"]
        self.volts = self.hours = None
        self._low = 0

    def measure(self):
        """Read the voltage; call it about once a second."""
        if self._converter is None:
            return
        now = self._converter.read_u16() * self._full_scale_v / 65535
        self.volts = now if self.volts is None else self.volts + (now - self.volts) / _CALM
        self.hours = self._hours * share_left(self.volts)
        self._low = self._low + 1 if now < self._empty_v else 0

    def empty(self):
        """Return whether the cell must be spared now: it has been empty for some seconds, not for one sag."""
        return self._low >= _EMPTY_READINGS
