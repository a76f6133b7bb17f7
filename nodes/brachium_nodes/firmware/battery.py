"""The cell: its voltage, how long it will last, and when to stop before it is harmed.

What is left is told from three things, and on the cautious side: the voltage, by a curve that is typical of
lithium-ion cells; how fast that has fallen since the node was switched on, for a cell may be old or cold and
the current is only said; and, where the voltage is low, how steeply it falls now.
"""

_CURVE = (0, 0, 125, 10, 200, 20, 253, 29, 289, 39, 315, 49, 335, 59, 350, 69, 370, 88, 390, 118, 425, 235)
_CURVE += (460, 360, 500, 470, 550, 580, 600, 680, 700, 830, 800, 960, 850, 1000)
# mV above 3.3 V, and thousandths of the charge that is left then, under a light load.
_CALM = 16
_EMPTY_READINGS = 10
_READINGS = 60  # of one mean: a converter of 10 bits steps by 5 mV
_MEANS = 6
_CAUTION = 0.72  # so much of what seems left is believed
_STEEP = 0.14  # of the time that a straight line would still take: the curve bends down
_LEARN = 0.15  # of the charge must be used before the cell's own pace is believed
_PACE = (0.5, 1.3)  # no cell is further from what is said of it


def share_left(volts):
    """Return how much of a cell's charge is left, 0 to 1."""
    above = 1000 * volts - 3300
    if above <= 0:
        return 0.0
    for at in range(2, len(_CURVE), 2):
        low, left, high, more = _CURVE[at - 2 : at + 2]
        if above < high:
            return (left + (more - left) * (above - low) / (high - low)) / 1000
    return 1.0


class Battery:
    """A cell seen by a converter with machine.ADC's read_u16; None where none is wired."""

    def __init__(self, converter, about):
        self._converter, self._full_scale_v = converter, about["full_scale_v"]
        self._whole_h, self._empty_v = about["capacity_mah"] / about["current_ma"], about["empty_v"]
        self.volts = self.hours = None
        self._low = 0
        self._sum = self._readings = self._minutes = 0
        self._means = []
        self._first = None  # share and minute
        self._pace = 1.0

    def measure(self):
        """Read the voltage; call it once a second."""
        if self._converter is None:
            return
        now = self._converter.read_u16() * self._full_scale_v / 65535
        self.volts = now if self.volts is None else self.volts + (now - self.volts) / _CALM
        self._low = self._low + 1 if now < self._empty_v else 0
        self._sum += now
        self._readings += 1
        if self._readings == _READINGS:
            self._means.append(self._sum / _READINGS)
            self._means = self._means[-_MEANS:]
            self._sum = self._readings = 0
            self._minutes += 1
            self.hours = self._left()
        elif self.hours is None or not self._means:
            self.hours = self._by_curve(self.volts)

    def empty(self):
        """Return whether the cell must be spared now: it has been empty for some seconds, not for one sag."""
        return self._low >= _EMPTY_READINGS

    def _by_curve(self, volts):
        return _CAUTION * self._pace * self._whole_h * share_left(volts)

    def _left(self):
        means = self._means
        now = sum(means[-2:]) / len(means[-2:])
        share = share_left(now)
        if self._first is None:
            self._first = share, self._minutes
        used = self._first[0] - share
        if used >= _LEARN:
            pace = (self._minutes - self._first[1]) / (60 * used * self._whole_h)
            self._pace = max(_PACE[0], min(_PACE[1], pace))
        hours = self._by_curve(now)
        if len(means) < _MEANS:
            return hours
        # The straight line through six means, V/h; a curve shifted by cold or age is set right by it.
        fall = -60 * sum((at - 2.5) * mean for at, mean in enumerate(means)) / 17.5
        above = max(0.0, sum(means) / _MEANS - self._empty_v)
        return max(hours, min(1.0, _STEEP * above / max(fall, 0.01)))
