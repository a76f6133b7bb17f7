"""The firmware reads a FIFO while the bus stands still, refuses or falls silent: numbers stay true."""

import pytest

WORLD = """
import random
import sensor
from device_clock import SampleClock

PERIOD, ROOM = 10000.4, 85

class Bus:
    # Virtual time in us, a sensor whose samples are their own numbers, and one stall at a named transfer.
    def __init__(self, seed, stalls_at, refuses):
        random.seed(seed)
        self.us, self.phase = 5000000.0, random.random() * PERIOD
        self.stalls_at, self.refuses = stalls_at, refuses
        self.first = self.end = 0
        self.lost = False
    def now(self):
        self.us += random.randrange(5, 20)
        return int(self.us)
    def taken(self):
        return int((self.us - self.phase) / PERIOD)
    def transfer(self, name):
        self.us += random.randrange(100, 300)
        since = self.us - 5000000
        if self.stalls_at == name and since > 2500000:
            self.stalls_at = None
            self.us += 1200000
        if random.random() < 0.02 or self.refuses[0] < since < self.refuses[1]:
            raise OSError(5)
        self.end = self.taken()
        if self.end - self.first > ROOM:
            self.first, self.lost = self.end - ROOM, True

class Driver:
    magnetometer, room = True, ROOM
    def __init__(self, bus):
        self.bus = bus
    def start(self, rate_hz):
        self.empty()
        return rate_hz
    def empty(self):
        for name in ("off", "reset", "on"):
            self.bus.transfer(name)
        self.bus.first, self.bus.lost = self.bus.taken(), False
        self.bus.transfer("clear")
    def gathered(self):
        self.bus.transfer("count")
        return -1 if self.bus.lost else self.bus.end - self.bus.first
    def read(self, into):
        self.bus.transfer("read")
        for at in range(0, len(into), 12):
            into[at : at + 4] = self.bus.first.to_bytes(4, "big")
            self.bus.first += 1
    def field(self, into):
        self.bus.transfer("field")
        return True

class Batches:
    def __init__(self):
        self.shifts = {}
    def add(self, number, taken, data, at, field):
        shift = int.from_bytes(data[at : at + 4], "big") - number
        self.shifts[shift] = self.shifts.get(shift, 0) + 1

def worn(seed, stalls_at, refuses=(0, 0)):
    bus, batches = Bus(seed, stalls_at, refuses), Batches()
    sensor.found = lambda _: Driver(bus)
    one = sensor.Sensor(None, 100, SampleClock, batches)
    while True:
        try:
            one.start(bus.now)
            break
        except OSError:
            pass
    while bus.us < 11000000:
        bus.us += 20000 + random.randrange(200, 2500)
        one.poll(bus.now)
    return [sorted(batches.shifts.values()), one.overflows, one.restarts, bus.stalls_at]

print(json.dumps([worn(seed, *given) for seed in range(40)]))
"""


@pytest.mark.parametrize("where", ["count", "read", "field"])
def test_a_bus_that_stands_still_for_longer_than_the_fifo_lasts_leaves_each_sample_its_number(on_chip, where):
    for counts, overflows, restarts, stalls_at in on_chip(WORLD, [where]):
        assert len(counts) == 1
        assert 430 < counts[0] < 490  # of 600, but for 1.2 s and what the start took
        assert (overflows, restarts) == (1, 0)
        assert stalls_at is None


@pytest.mark.parametrize("stalls_at", [None, "clear"])
def test_a_sensor_that_is_started_anew_goes_on_with_its_own_numbers(on_chip, stalls_at):
    for counts, _, restarts, stalls_still_at in on_chip(WORLD, [stalls_at, [1_500_000, 3_800_000]]):
        assert stalls_still_at is None
        assert len(counts) == 1
        assert counts[0] > 200
        assert restarts == 1
