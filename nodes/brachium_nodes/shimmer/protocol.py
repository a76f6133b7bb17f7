"""Shimmer3's serial protocol (LogAndStream firmware): requests, and what their answers hold. Pure.

Every request is acknowledged by 0xFF; an answer follows it at once. Numbers are little-endian unless said.
"""

from dataclasses import dataclass
from struct import pack, unpack
from typing import Literal

ACK, NACK = 0xFF, 0xFE
DATA = 0x00
IN_STREAM = 0x8A
"""First byte of answers that may come between data packets; the next byte says which."""
BATTERY_ANSWER, STATUS_ANSWER = 0x94, 0x71

TICK_HZ = 32768
"""Of the device's clock, and of its sampling rate's divider."""

SHIMMER3 = 3
LOG_AND_STREAM = 3
OLDEST_FIRMWARE = (0, 6)
"""Before it time stamps had 16 bits and wrapped every 2 s."""

Accelerometer = Literal["low-noise", "wide-range"]
Kind = Literal["low-noise", "wide-range", "gyr", "mag"]


class ShimmerError(RuntimeError):
    """The device cannot be used, or does not answer; the text says what to do."""


@dataclass(frozen=True, slots=True)
class Request:
    """What is sent, and what must come back after the acknowledgement: a prefix, and so many bytes."""

    name: str
    words: bytes
    answer: bytes = b""
    length: int = 0
    """Of the answer after its prefix; of an inquiry, the part that says how long the rest is."""
    counted: bool = False
    """Byte 6 of the answer counts the bytes that follow `length`."""


FIRMWARE = Request("firmware version", b"\x2e", b"\x2f", 6)
HARDWARE = Request("device version", b"\x3f", b"\x25", 1)
BOARD = Request("board version", b"\x66\x03\x00", b"\x65\x03", 3)
INQUIRY = Request("inquiry", b"\x01", b"\x02", 8, counted=True)
CALIBRATION = Request("calibration", b"\x2c", b"\x2d", 84)
BATTERY = Request("battery", b"\x95", bytes([IN_STREAM, BATTERY_ANSWER]), 3)
START = Request("start", b"\x07")
STOP = Request("stop", b"\x20")


def set_rate(ticks: int) -> Request:
    """Return the request that samples every `ticks` of the clock."""
    return Request("sampling rate", b"\x05" + pack("<H", ticks))


def set_sensors(accelerometer: Accelerometer) -> Request:
    """Return the request that switches on one accelerometer, gyroscope and magnetometer, and nothing else."""
    low_noise, wide_range = (0x80, 0x00) if accelerometer == "low-noise" else (0x00, 0x10)
    return Request("sensors", bytes([0x08, low_noise | 0x40 | 0x20, wide_range, 0x00]))


def set_byte(name: str, command: int, value: int) -> Request:
    """Return a request that sets one register to a byte."""
    return Request(name, bytes([command, value]))


SET_ACCEL_RANGE, SET_ACCEL_RATE = 0x09, 0x40
SET_GYRO_RANGE, SET_GYRO_RATE = 0x49, 0x4C
SET_MAG_RANGE, SET_MAG_RATE = 0x37, 0x3A


@dataclass(frozen=True, slots=True, kw_only=True)
class Inquiry:
    """How the device is set: the answer to INQUIRY."""

    ticks: int
    """Of the clock between two samples."""
    accel_range: int
    """Register of the wide-range accelerometer; calibration.nominal knows what it means on which chip."""
    gyro_range: int
    """0 to 3 is 250, 500, 1000, 2000 deg/s."""
    mag_range: int
    channels: tuple[int, ...]


def read_inquiry(body: bytes) -> Inquiry:
    """Return what an answer to INQUIRY says (8 bytes and one for each channel)."""
    ticks, setup = unpack("<HI", body[:6])
    if not ticks:
        raise ShimmerError("the device says that it never samples; set its sampling rate and try again")
    return Inquiry(
        ticks=ticks,
        accel_range=(setup >> 2) & 3,
        gyro_range=(setup >> 16) & 3,
        mag_range=(setup >> 21) & 7,
        channels=tuple(body[8 : 8 + body[6]]),
    )


def read_firmware(body: bytes) -> tuple[int, tuple[int, int, int]]:
    """Return the firmware's kind and its version."""
    kind, major, minor, patch = unpack("<HHBB", body)
    return kind, (major, minor, patch)


NEWER_BOARDS = {31: 6, 38: 3, 47: 3, 48: 3, 49: 2}
"""By board: the first revision with the LSM303AH and the KXTC9-2050; before it LSM303DLHC and KXRB5-2042."""
SPECIAL_REVISION = 171
"""Marks any board on a base with the newer chips."""


def newer_chips(body: bytes) -> bool:
    """Return whether the board that BOARD names carries the chips of 2018 and after."""
    board, revision, special = body
    return special == SPECIAL_REVISION or revision >= NEWER_BOARDS.get(board, 256)


def battery_v(body: bytes) -> float | None:
    """Return the battery's voltage from the answer to BATTERY; None before the device has measured it.

    12 bits of 3 V behind a divider of 1.988.
    """
    (steps,) = unpack("<H", body[:2])
    return steps / 4095 * 3.0 * 1.988 if 0 < steps < 4096 else None


CHANNELS: dict[int, tuple[Kind, int]] = {
    0x00: ("low-noise", 0), 0x01: ("low-noise", 1), 0x02: ("low-noise", 2),
    0x04: ("wide-range", 0), 0x05: ("wide-range", 1), 0x06: ("wide-range", 2),
    0x07: ("mag", 0), 0x08: ("mag", 1), 0x09: ("mag", 2),
    0x0A: ("gyr", 0), 0x0B: ("gyr", 1), 0x0C: ("gyr", 2),
}  # fmt: skip
"""Channel to sensor and axis; two bytes each in a data packet, in the order in which INQUIRY names them."""


def layout(channels: tuple[int, ...], *, newer: bool) -> tuple[str, dict[Kind, tuple[int, int, int]]]:
    """Return the struct format of each channel's two bytes, one after the other, and where each axis stands.

    The analogue accelerometer is u16 (12 bits), all else i16. Gyroscope, and the magnetometer of older
    boards, send the high byte first. Raises ShimmerError for a channel that was not asked for.
    """
    formats, places = "", dict[Kind, dict[int, int]]()
    for position, channel in enumerate(channels):
        if channel not in CHANNELS:
            raise ShimmerError(
                f"channel 0x{channel:02x} was not asked for: this firmware lays its packets out differently"
            )
        kind, axis = CHANNELS[channel]
        big = kind == "gyr" or (kind == "mag" and not newer)
        formats += (">" if big else "<") + ("H" if kind == "low-noise" else "h")
        places.setdefault(kind, {})[axis] = position
    for kind, axes in places.items():
        if len(axes) != 3:
            raise ShimmerError(f"{kind}: {len(axes)} of 3 axes are streamed; update the firmware")
    return formats, {kind: (axes[0], axes[1], axes[2]) for kind, axes in places.items()}
