"""The bytes of an arm on CAN, as brachium_arm.dbc describes them, with alive counter and CRC. Pure."""

from collections.abc import Sequence
from enum import IntEnum
from math import isfinite
from struct import pack
from typing import NamedTuple

ANGLE_STEP = 0.0005
"""rad: 16.4 rad of range, so that continuous angles may turn over twice; a step is 0.03 deg."""
SPEED_STEP = 0.002
"""rad/s: to 65 rad/s; nobody throws faster."""
SD_STEP = 0.002
"""rad: to 0.5 rad."""
AGE_STEP_NS = 2_000_000
NO_ANGLE, NO_SD, NO_TIME, NO_AGE = -32768, 255, 0xFFFFFFFF, 255
"""What stands where there is no value."""
ORIGINS = {"worn": 0, "emulated": 1, "playback": 2}


class Reason(IntEnum):
    """Why a joint is not valid."""

    VALID = 0
    SILENT = 1
    """No skeleton came for a while: node, router or fusion are gone, or there never was one."""
    STALE = 2
    """The last one is of too long ago, or by how much is not known."""
    NOT_MEASURED = 3
    """Fusion does not call it measured and good."""
    IMPLAUSIBLE = 4
    """A segment jumped as no arm moves; it stays so until the next calibration or zero."""
    SETTLING = 5
    """It was there again only just now."""
    ORIGIN = 6
    """Nobody wears these sensors."""
    RANGE = 7
    """It does not fit the frame, or its standard deviation is too large."""


class JointValue(NamedTuple):
    """One joint as it goes out; the numbers count only where `reason` is VALID."""

    reason: Reason
    angle_rad: float = 0.0
    speed_rad_s: float = 0.0
    sd_rad: float | None = None


class ArmValue(NamedTuple):
    """One arm as it goes out."""

    time_ns: int | None
    """Host time of the sample; None before the first."""
    age_ns: int | None
    origin: str
    joints: Sequence[JointValue]


def classic_frames(first_id: int, alive: int, arm: ArmValue) -> list[tuple[int, bytes]]:
    """Return the eight frames (id, 8 bytes) of an arm; `alive` counts 0..15."""
    age = _age(arm.age_ns)
    status = alive | ORIGINS.get(arm.origin, 3) << 4
    head = pack("<BBBI", status, _mask(arm.joints), age, _milliseconds(arm.time_ns))
    frames = [(first_id, _sealed(first_id, head))]
    for place, joint in enumerate(arm.joints, start=1):
        valid = joint.reason is Reason.VALID
        body = pack("<BhhBB", alive | valid << 4 | joint.reason << 5, *_numbers(joint), _sd(joint), age)
        frames.append((first_id + place, _sealed(first_id + place, body)))
    return frames


def fd_frame(first_id: int, alive: int, arm: ArmValue) -> tuple[int, bytes]:
    """Return the one CAN FD frame (id, 64 bytes) of an arm."""
    number = first_id + 8
    age_ms = 0xFFFF if arm.age_ns is None else min(max(arm.age_ns // 1_000_000, 0), 0xFFFE)
    status = alive | ORIGINS.get(arm.origin, 3) << 4
    body = pack("<BBIHH", status, _mask(arm.joints), _milliseconds(arm.time_ns), age_ms, 0)
    for joint in arm.joints:
        flags = (joint.reason is Reason.VALID) | joint.reason << 1
        body += pack("<hhBB", *_numbers(joint), _sd(joint), flags)
    body = body.ljust(62, b"\0")
    return number, pack("<H", crc16(pack("<H", number) + body)) + body


def crc8(data: bytes) -> int:
    """Return CRC-8 SAE J1850: polynomial 0x1D, from 0xFF, inverted at the end. Of "123456789": 0x4B."""
    crc = 0xFF
    for byte in data:
        crc = _CRC8[crc ^ byte]
    return crc ^ 0xFF


def crc16(data: bytes) -> int:
    """Return CRC-16 CCITT-FALSE: polynomial 0x1021, from 0xFFFF. Of "123456789": 0x29B1."""
    crc = 0xFFFF
    for byte in data:
        crc = (crc << 8 & 0xFFFF) ^ _CRC16[crc >> 8 ^ byte]
    return crc


def fits(angle_rad: float) -> bool:
    """Return whether an angle has room in a frame."""
    return isfinite(angle_rad) and abs(angle_rad) < -NO_ANGLE * ANGLE_STEP - ANGLE_STEP


def _table(polynomial: int, bits: int) -> list[int]:
    top, mask, table = 1 << bits - 1, (1 << bits) - 1, []
    for byte in range(256):
        crc = byte << bits - 8
        for _ in range(8):
            crc = (crc << 1 ^ (polynomial if crc & top else 0)) & mask
        table.append(crc)
    return table


_CRC8, _CRC16 = _table(0x1D, 8), _table(0x1021, 16)


def _sealed(number: int, body: bytes) -> bytes:
    """Return a frame with its CRC in front, taken over the id (low byte first) and the other seven bytes."""
    return bytes([crc8(pack("<H", number) + body)]) + body


def _mask(joints: Sequence[JointValue]) -> int:
    return sum((joint.reason is Reason.VALID) << place for place, joint in enumerate(joints))


def _numbers(joint: JointValue) -> tuple[int, int]:
    if joint.reason is not Reason.VALID:
        return NO_ANGLE, NO_ANGLE
    speed = min(max(round(joint.speed_rad_s / SPEED_STEP), -32767), 32767)
    return round(joint.angle_rad / ANGLE_STEP), speed


def _sd(joint: JointValue) -> int:
    if joint.reason is not Reason.VALID or joint.sd_rad is None:
        return NO_SD
    return min(max(round(joint.sd_rad / SD_STEP), 0), NO_SD - 1)


def _age(age_ns: int | None) -> int:
    return NO_AGE if age_ns is None else min(max(age_ns // AGE_STEP_NS, 0), NO_AGE)


def _milliseconds(time_ns: int | None) -> int:
    return NO_TIME if time_ns is None else time_ns // 1_000_000 % NO_TIME
