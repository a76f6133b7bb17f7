"""The firmware reads a FIFO while the bus stands still, refuses or falls silent: numbers stay true."""

import pytest

CHECKED = """
import random
import sensor
from device_clock import SampleClock

class Batches:
    # How often each distance was seen between a sample's number and the one that it has by its content.
    def __init__(self):
        self.shifts = {}
    def add(self, number, taken, data, at, field):
        shift = int.from_bytes(data[at : at + 4], "big") - number
        self.shifts[shift] = self.shifts.get(shift, 0) + 1

"""
WORLD = (
    CHECKED
    + """
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
    magnetometer, room, at_once = True, ROOM, 16
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
)

CHIP = (
    CHECKED
    + """
class Bus:
    # A chip at its registers: 18 samples gather between two looks, and 3 transfers in 100 are refused.
    def __init__(self, who, counted_at, read_at, packet, start):
        self.who, self.counted_at, self.read_at = who, counted_at, read_at
        self.packet, self.start = packet, start
        self.waiting = self.next = 0
        self.sure = True
    def readfrom_mem(self, address, register, size):
        data = bytearray(size)
        self.readfrom_mem_into(address, register, data)
        return data
    def readfrom_mem_into(self, address, register, data):
        if not self.sure and random.random() < 0.03:
            raise OSError(5)
        for at in range(len(data)):
            data[at] = 0
        if register == 0x75 and address == 0x68:
            data[0] = self.who
        elif register == 0 and address == 0x0c:
            data[0] = 0x48
        elif register == self.counted_at:
            size = self.waiting * self.packet
            data[0], data[1] = size >> 8, size & 255
        elif register == self.read_at:
            for at in range(0, len(data), self.packet):
                assert self.waiting, "more was read than had gathered"
                data[at + self.start : at + self.start + 4] = self.next.to_bytes(4, "big")
                self.next, self.waiting = self.next + 1, self.waiting - 1
    def writeto_mem(self, address, register, data):
        pass

def worn(seed, chip):
    random.seed(seed)
    bus, batches, us = Bus(*chip), Batches(), 5000000
    one = sensor.Sensor(bus, 100, SampleClock, batches)
    one.start(lambda: us)
    bus.sure = False
    for _ in range(60):
        us += 180000
        bus.waiting += 18
        one.poll(lambda: us)
    bus.sure = True
    one.poll(lambda: us)
    return [len(batches.shifts), sum(batches.shifts.values()), bus.next, one.errors > 0]

print(json.dumps([worn(seed, given) for seed in range(5)]))
"""
)


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


@pytest.mark.parametrize(
    "chip",
    [
        pytest.param([0x71, 0x72, 0x74, 12, 0], id="MPU-9250"),
        pytest.param([0x47, 0x2E, 0x30, 16, 1], id="ICM-42688-P"),
    ],
)
def test_a_refusal_amid_many_waiting_samples_costs_none_of_them(on_chip, chip):
    for shifts, kept, read, refused in on_chip(CHIP, chip):
        assert refused
        assert shifts == 1
        assert kept == read == 1080
