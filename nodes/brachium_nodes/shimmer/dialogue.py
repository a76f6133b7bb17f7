"""Setting a Shimmer3 up, request by request: bytes and times in, bytes and the device out. Pure."""

from collections.abc import Generator
from dataclasses import dataclass

from brachium_nodes.shimmer import protocol as p
from brachium_nodes.shimmer.calibration import Converted, conversions

QUIET_NS = 300_000_000
"""A device that may still stream is told to stop, and has stopped when it said nothing for so long."""
PATIENCE_NS = 1_500_000_000
"""For one answer; Bluetooth sends lost frames again for about a second."""
TRIES = 3
FIRST_TRIES = 8
"""Of the first request: opening a Bluetooth port only begins to look for the device, for some seconds."""
LONGEST_QUIETING_NS = 5_000_000_000


@dataclass(frozen=True, slots=True, kw_only=True)
class Wish:
    """How the device shall be set."""

    rate_hz: float = 51.2
    accelerometer: p.Accelerometer = "wide-range"
    accel_g: int = 8
    """Of the wide-range accelerometer; the low-noise one has 2 g and no other."""
    gyro_dps: int = 2000

    def __post_init__(self) -> None:
        """Raise ValueError for what no Shimmer3 does."""
        if not 1.0 <= self.rate_hz <= 512.0:
            raise ValueError(f"rate {self.rate_hz} Hz cannot be used; give 1 to 512 Hz")
        if self.accel_g not in _ACCEL_G:
            raise ValueError(f"an accelerometer range of {self.accel_g} g cannot be used; give 2, 4, 8 or 16")
        if self.gyro_dps not in _GYRO_DPS:
            raise ValueError(
                f"a gyroscope range of {self.gyro_dps} deg/s cannot be used; give 250, 500, 1000 or 2000"
            )

    @property
    def ticks(self) -> int:
        """The divider of the clock that is nearest to the rate."""
        return round(p.TICK_HZ / self.rate_hz)


_ACCEL_G, _ACCEL_G_NEWER = (2, 4, 8, 16), (2, 16, 4, 8)
_GYRO_DPS = (250, 500, 1000, 2000)
_MAG_RANGE, _MAG_RATE, _MAG_RATE_NEWER = 1, 6, 3
"""The LSM303DLHC's +-1.3 gauss at 75 Hz, the LSM303AH's 100 Hz: both faster than this project needs."""
_DLHC_RATES_HZ = (0, 1, 10, 25, 50, 100, 200, 400)
_AH_RATES_HZ = (0, 12.5, 25, 50, 100, 200, 400, 800)


@dataclass(frozen=True, slots=True, kw_only=True)
class Device:
    """A device that streams: what it is, and how its packets are read."""

    firmware: str
    newer: bool
    ticks: int
    formats: str
    """Struct format of each channel's two bytes."""
    places: dict[p.Kind, tuple[int, int, int]]
    """Where a sensor's axes stand among the channels."""
    accelerometer: p.Accelerometer
    converted: Converted
    battery_v: float | None

    @property
    def rate_hz(self) -> float:
        """Samples a second of the device's own clock."""
        return p.TICK_HZ / self.ticks


Steps = Generator[p.Request, bytes, Device]


def set_up(wish: Wish) -> Steps:
    """Yield requests, take their answers' bodies; return the streaming device. Raises ShimmerError."""
    kind, version = p.read_firmware((yield p.FIRMWARE))
    (hardware,) = yield p.HARDWARE
    if hardware != p.SHIMMER3 or kind != p.LOG_AND_STREAM or version[:2] < p.OLDEST_FIRMWARE:
        raise p.ShimmerError(
            f"hardware {hardware}, firmware {kind} {'.'.join(map(str, version))}: a Shimmer3 (3) with "
            f"LogAndStream (3) {'.'.join(map(str, p.OLDEST_FIRMWARE))} or newer is needed; update it"
        )
    newer = p.newer_chips((yield p.BOARD))
    yield from _settings(wish, newer=newer)
    inquiry = p.read_inquiry((yield p.INQUIRY))
    formats, places = p.layout(inquiry.channels, newer=newer)
    for sensor in (wish.accelerometer, "gyr", "mag"):
        if sensor not in places:
            raise p.ShimmerError(f"{sensor} was asked for and is not streamed; restart the device")
    blocks = yield p.CALIBRATION
    battery = p.battery_v((yield p.BATTERY))
    yield p.START
    return Device(
        firmware=f"LogAndStream {'.'.join(map(str, version))}",
        newer=newer,
        ticks=inquiry.ticks,
        formats=formats,
        places=places,
        accelerometer=wish.accelerometer,
        converted=conversions(inquiry, blocks, wish.accelerometer, newer=newer),
        battery_v=battery,
    )


def _settings(wish: Wish, *, newer: bool) -> Generator[p.Request, bytes, None]:
    rate_hz = p.TICK_HZ / wish.ticks
    accel = (_ACCEL_G_NEWER if newer else _ACCEL_G).index(wish.accel_g)
    rates = _AH_RATES_HZ if newer else _DLHC_RATES_HZ
    fast_enough = next(i for i, hz in enumerate(rates) if hz >= min(rate_hz, rates[-1]))
    # The MPU-9150 divides 8 kHz; rounded up, so that no sample is read twice.
    divider = min(max(int(8000.0 / rate_hz) - 1, 0), 255)
    yield p.set_rate(wish.ticks)
    yield p.set_sensors(wish.accelerometer)
    yield p.set_byte("accelerometer range", p.SET_ACCEL_RANGE, accel)
    yield p.set_byte("accelerometer rate", p.SET_ACCEL_RATE, fast_enough)
    yield p.set_byte("gyroscope range", p.SET_GYRO_RANGE, _GYRO_DPS.index(wish.gyro_dps))
    yield p.set_byte("gyroscope rate", p.SET_GYRO_RATE, divider)
    yield p.set_byte("magnetometer range", p.SET_MAG_RANGE, 0 if newer else _MAG_RANGE)
    yield p.set_byte("magnetometer rate", p.SET_MAG_RATE, _MAG_RATE_NEWER if newer else _MAG_RATE)


class Dialogue:
    """Drives `set_up` over a connection that has just been opened."""

    def __init__(self, wish: Wish, now_ns: int) -> None:
        self._steps = set_up(wish)
        self._request: p.Request | None = None
        self._begun_ns = self._heard_ns = self._asked_ns = now_ns
        self._tries = 0
        self._buffer = bytearray()
        self.device: Device | None = None
        """Set when it streams; `rest` is then the first of its packets."""

    @property
    def rest(self) -> bytes:
        """What came after the last answer."""
        return bytes(self._buffer)

    def begin(self) -> bytes:
        """Return what to send first."""
        return p.STOP.words

    def receive(self, data: bytes, now_ns: int) -> bytes:
        """Take what came at `now_ns`; return what to send, if anything. Raises ShimmerError."""
        self._heard_ns = now_ns
        if self._request is None:
            return b""  # what an interrupted stream still sends
        self._buffer += data
        body = self._answer(self._request)
        return b"" if body is None else self._next(body, now_ns)

    def tick(self, now_ns: int) -> bytes:
        """Return what time asks to send. Raises ShimmerError when the device does not answer."""
        if self.device is not None:
            return b""
        if self._request is None:
            if now_ns - self._heard_ns >= QUIET_NS:
                return self._next(None, now_ns)
            if now_ns - self._begun_ns >= LONGEST_QUIETING_NS:
                raise p.ShimmerError("the port does not fall silent: it is no Shimmer3, or another program's")
            return b""
        if now_ns - self._asked_ns < PATIENCE_NS:
            return b""
        if self._tries >= (FIRST_TRIES if self._request is p.FIRMWARE else TRIES):
            raise p.ShimmerError(
                f"no answer to {self._request.name}: is it a Shimmer3, switched on and near by?"
            )
        self._tries, self._asked_ns = self._tries + 1, now_ns
        self._buffer.clear()
        return self._request.words

    def _next(self, body: bytes | None, now_ns: int) -> bytes:
        try:
            self._request = next(self._steps) if body is None else self._steps.send(body)
        except StopIteration as done:
            self.device = done.value
            return b""
        self._tries, self._asked_ns = 1, now_ns
        return self._request.words

    def _answer(self, request: p.Request) -> bytes | None:
        """Return the answer's body once it is whole, and take it from the buffer.

        Anything before the acknowledgement is skipped: a device tells of its dock when it likes to.
        """
        if p.NACK in self._buffer[:1]:
            raise p.ShimmerError(f"the device refuses {request.name}: update its firmware")
        head = bytes([p.ACK]) + request.answer
        at = self._buffer.find(head)
        if at < 0:
            return None
        begin = at + len(head)
        length = request.length
        if request.counted:
            if len(self._buffer) < begin + length:
                return None
            length += self._buffer[begin + 6]
        if len(self._buffer) < begin + length:
            return None
        body = bytes(self._buffer[begin : begin + length])
        del self._buffer[: begin + length]
        return body
