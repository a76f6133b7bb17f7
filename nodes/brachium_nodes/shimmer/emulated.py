"""An emulated Shimmer3: a device's side of the serial protocol, bytes in and bytes out. Pure.

It is written from the protocol's facts alone and shares no line with the reading side, so that each is a
check of the other.
"""

import struct
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from brachium_nodes.sensors import generator

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Factory:
    """One chip as it left the factory: raw = offset + diag(sensitivity) alignment value."""

    offset: Floats
    """(3,) whole steps."""
    sensitivity: Floats
    """(3,) steps a m/s^2, a deg/s or a gauss."""
    alignment: Floats
    """(3, 3) in whole hundredths."""

    def steps(self, value: npt.ArrayLike, lowest: int, highest: int) -> list[int]:
        """Return the raw reading of a value (3,) in case axes."""
        raw = self.offset + self.sensitivity * (self.alignment @ np.asarray(value, dtype=np.float64))
        return [int(step) for step in np.clip(np.rint(raw), lowest, highest)]

    def block(self, scale: float = 1.0) -> bytes:
        """Return its 21 bytes in the device's memory."""
        numbers = np.rint([*self.offset, *(scale * self.sensitivity), *(100.0 * self.alignment).ravel()])
        return struct.pack(">hhhhhhbbbbbbbbb", *numbers.astype(int).tolist())


def factory(seed: int) -> dict[str, Factory]:
    """Return a newer device's chips, each a little off its data sheet; `seed` draws by how much.

    LN: KXTC9-2050 (2253 steps at rest, 92 a m/s^2). WR: LSM303AH at 8 g. Gyroscope: MPU-9150 at 2000 deg/s.
    Magnetometer: LSM303AH.
    """
    random = generator(seed, "shimmer", "factory")
    turned = np.array([[0.0, -1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
    other = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])

    def chip(offset: float, spread: float, sensitivity: float, per_step: float, axes: Floats) -> Factory:
        return Factory(
            np.rint(offset + spread * random.standard_normal(3)),
            np.rint(sensitivity * (1.0 + 0.01 * random.standard_normal(3)) / per_step) * per_step,
            np.rint(100.0 * (axes + 0.01 * random.standard_normal((3, 3)))).clip(-100, 100) / 100.0,
        )

    return {
        "low-noise": chip(2253.0, 20.0, 92.0, 1.0, turned),
        "gyr": chip(0.0, 30.0, 16.4, 0.01, turned),
        "mag": chip(0.0, 60.0, 667.0, 1.0, other),
        "wide-range": chip(0.0, 15.0, 418.0, 1.0, other),
    }


@dataclass(slots=True)
class EmulatedShimmer:
    """The device. What it measures is asked from `measured(number)`: acc m/s^2, gyr rad/s, mag uT (3,) each,
    in the axes printed on its case."""

    measured: Callable[[int], tuple[Floats, Floats, Floats]]
    seed: int = 0
    battery_steps: int = 2700
    streaming: bool = False
    chips: dict[str, Factory] = field(init=False)
    period: int = 640
    _sensors: bytes = b"\x80\x00\x00"
    _setup: bytearray = field(default_factory=lambda: bytearray(4))
    _pending: bytearray = field(default_factory=bytearray)

    def __post_init__(self) -> None:
        """Take the chips from the factory."""
        self.chips = factory(self.seed)

    def receive(self, data: bytes) -> bytes:
        """Return the answers to what the host sent."""
        self._pending += data
        out = b""
        while self._pending:
            extra = {
                0x05: 2,
                0x08: 3,
                0x66: 2,
                **dict.fromkeys((0x09, 0x40, 0x49, 0x4C, 0x37, 0x3A, 0xA3), 1),
            }
            length = 1 + extra.get(self._pending[0], 0)
            if len(self._pending) < length:
                break
            command = bytes(self._pending[:length])
            del self._pending[:length]
            out += b"\xff" + self._obey(command[0], command[1:])
        return out

    def _obey(self, command: int, words: bytes) -> bytes:
        setup, answer = self._setup, b""
        if command == 0x2E:  # LogAndStream (3) 0.16.4
            answer = b"\x2f" + bytes([3, 0, 0, 0, 16, 4])
        elif command == 0x3F:
            answer = b"\x25\x03"
        elif command == 0x66:  # board SR31, revision 6
            answer = b"\x65" + words[:1] + bytes([31, 6, 0])
        elif command == 0x03:
            answer = b"\x04" + bytes([self.period & 255, self.period >> 8])
        elif command == 0x05:
            self.period = words[0] + 256 * words[1]
        elif command == 0x08:
            self._sensors = words
        elif command == 0x09:
            setup[0] = setup[0] & ~0x0C | words[0] << 2
        elif command == 0x40:
            setup[0] = setup[0] & ~0xF0 | words[0] << 4
        elif command == 0x4C:
            setup[1] = words[0]
        elif command == 0x49:
            setup[2] = setup[2] & ~0x03 | words[0]
        elif command == 0x37:
            setup[2] = setup[2] & ~0xE0 | words[0] << 5
        elif command == 0x3A:
            setup[2] = setup[2] & ~0x1C | words[0] << 2
        elif command == 0x01:
            channels = self._channels()
            head = bytes([self.period & 255, self.period >> 8, *setup, len(channels), 1])
            answer = b"\x02" + head + bytes(channels)
        elif command == 0x2C:
            chips = self.chips
            answer = b"\x2d" + chips["low-noise"].block() + chips["gyr"].block(100.0)
            answer += chips["mag"].block() + chips["wide-range"].block()
        elif command == 0x95:
            answer = b"\x8a\x94" + bytes([self.battery_steps & 255, self.battery_steps >> 8, 0xC0])
        elif command in (0x07, 0x20):
            self.streaming = command == 0x07
        return answer

    def _channels(self) -> list[int]:
        """Analogue channels come first, then gyroscope, wide-range accelerometer, magnetometer."""
        analogue = [0, 1, 2] if self._sensors[0] & 0x80 else []
        gyro = [10, 11, 12] if self._sensors[0] & 0x40 else []
        wide = [4, 5, 6] if self._sensors[1] & 0x10 else []
        field_ = [7, 8, 9] if self._sensors[0] & 0x20 else []
        return [*analogue, *gyro, *wide, *field_]

    def packet(self, number: int, stamp: int) -> bytes:
        """Return one sample as it streams it; `stamp` in ticks of 1 / 32768 s."""
        acc, gyr, mag = self.measured(number)
        out = b"\x00" + bytes([stamp & 255, stamp >> 8 & 255, stamp >> 16 & 255])
        channels = self._channels()
        if 0 in channels:  # 12 bits, low byte first
            out += struct.pack("<3H", *self.chips["low-noise"].steps(acc, 0, 4095))
        if 10 in channels:  # high byte first
            out += struct.pack(">3h", *self.chips["gyr"].steps(np.degrees(gyr), -32768, 32767))
        if 4 in channels:  # low byte first
            out += struct.pack("<3h", *self.chips["wide-range"].steps(acc, -32768, 32767))
        if 7 in channels:  # the newer chip: low byte first
            out += struct.pack("<3h", *self.chips["mag"].steps(mag / 100.0, -32768, 32767))
        return out
