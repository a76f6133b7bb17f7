"""The sensor: whichever known chip answers on the bus, started again when it falls silent."""

KNOWN = {
    (0x75, 0x68): "mpu9150",
    (0x75, 0x71): "mpu9150",
    (0x75, 0x73): "mpu9150",
    (0x75, 0x47): "icm42688",
}  # what a register says, and the driver for it; another chip: one more file with the same names
ADDRESSES = (0x68, 0x69)
SILENT_US = 2_000_000


def found(bus):
    """Return the driver of the chip that answers; only its file is loaded. Raises OSError when none does."""
    seen = "none at all"
    for address in ADDRESSES:
        for (register, who), name in KNOWN.items():
            try:
                answer = bus.readfrom_mem(address, register, 1)[0]
            except OSError:
                continue
            if answer == who:
                return __import__(name).Driver(bus, address, who)
            seen = "0x%02x at 0x%02x" % (answer, address)
    raise OSError("no known sensor answers (%s); look at its four wires" % seen)


class Sensor:
    """Moves samples from the chip into batches, numbered and timed; `errors` counts what the bus refused."""

    def __init__(self, bus, rate_hz, make_clock, batches):
        self._bus, self._asked_hz, self._batches = bus, rate_hz, batches
        self._make_clock = make_clock
        self.driver = self.clock = None
        self.rate_hz = rate_hz
        self._data, self._field = None, bytearray(6)
        self._heard = 0
        self._broken = False
        self.errors = self.overflows = self.restarts = 0

    def start(self, now):
        """Find and start the chip. Raises OSError."""
        self.driver = found(self._bus)
        rate_hz = self.driver.start(self._asked_hz)
        if self.clock is None:
            self.rate_hz, self.clock = rate_hz, self._make_clock(rate_hz)
            self._data = bytearray(12 * self.driver.at_once)
        else:
            self._broken = True  # nobody knows which samples the start has thrown away
        self._heard = now()

    def poll(self, now):
        """Take what has gathered; a refusal of the bus costs nothing but the time to the next poll."""
        try:
            self._poll(now)
        except OSError:
            self.errors += 1
        if now() - self._heard > SILENT_US:
            self.restarts += 1
            self._heard = now()
            try:
                self.start(now)
            except OSError:
                self.errors += 1

    def _poll(self, now):
        driver, clock = self.driver, self.clock
        if self._broken:
            for _ in range(5):
                before = now()
                driver.empty()
                after = now()
                if not clock.due_between(before, after):
                    break  # else nobody knows whether that sample was thrown away
            self._broken = False
            clock.skip(after)
            return
        before = now()
        waiting = driver.gathered()
        if waiting < 0:
            self._overflow(now)
            return
        clock.read(before, now(), waiting)
        while waiting:
            part = memoryview(self._data)[: 12 * min(waiting, driver.at_once)]
            self._read(part)
            if waiting + clock.count(now() - before) >= driver.room:
                self._overflow(now)  # since they were counted: what was read may not be the oldest
                return
            field = self._new_field()
            for at in range(0, len(part), 12):
                number = clock.number
                self._batches.add(number, clock.take(), self._data, at, field)
                field = None
            waiting -= len(part) // 12
            self._heard = now()

    def _overflow(self, now):
        self.overflows += 1
        self._broken = True
        self._poll(now)

    def _new_field(self):
        """Return the field at the oldest sample just read; a refusal must not cost the samples."""
        if not self.driver.magnetometer:
            return None
        try:
            return self._field if self.driver.field(self._field) else None
        except OSError:
            self.errors += 1
            return None

    def _read(self, part):
        """Read samples that are known to wait: one refusal is tried again, for their times are given."""
        for _ in range(3):
            try:
                self.driver.read(part)
                return
            except OSError:
                self.errors += 1
        self._broken = True
        raise OSError("the bus refuses")
