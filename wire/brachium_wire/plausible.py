"""What no true message holds, though every field has its type: looked for once, at the door."""

from collections.abc import Callable, Iterable
from math import sqrt
from typing import Any

from brachium_wire.messages import Calibration, Info, Message, Quaternion, Session, Skeleton, Status

LENGTH_TOLERANCE = 0.05
"""How far a quaternion's length may be from 1: coarsely packed ones are within 0.02."""
MAX_RATE_HZ = 20_000.0
MAX_HEIGHT_M = 3.0


def fault(message: Message) -> str | None:
    """Return what cannot be true of a decoded message, or None."""
    check = _CHECKS.get(type(message))
    return None if check is None else check(message)


def _info(info: Info) -> str | None:
    if not 0.0 < info.rate_hz <= MAX_RATE_HZ:
        return f"rate must be above 0 and at most {MAX_RATE_HZ:g} Hz, came {info.rate_hz:g}"
    return _turns("mnt", [info.mounting])


def _status(status: Status) -> str | None:
    if min(status.received, status.lost, status.out_of_order, status.late) < 0:
        return "rcv, lost, ooo and late are counts, one is negative"
    return None


def _skeleton(skeleton: Skeleton) -> str | None:
    poses = skeleton.segments.values()
    turns = [skeleton.trunk_from_world, *(p.world_from_segment for p in poses)]
    return _turns("trunk, q or sq", [*turns, *(p.world_from_sensor for p in poses)])


def _calibration(calibration: Calibration) -> str | None:
    return _turns("mnt", calibration.mounting.values())


def _session(session: Session) -> str | None:
    if session.height_m is not None and not 0.0 < session.height_m <= MAX_HEIGHT_M:
        return f"height_m must be above 0 and at most {MAX_HEIGHT_M:g} m, came {session.height_m:g}"
    for name, length in session.lengths_m.items():
        if not 0.0 < length <= MAX_HEIGHT_M:
            return f"lengths_m of {name} must be above 0 and at most {MAX_HEIGHT_M:g} m, came {length:g}"
    return None


def _turns(names: str, quaternions: Iterable[Quaternion | None]) -> str | None:
    for q in quaternions:
        if q is not None:
            w, x, y, z = q
            if not abs(sqrt(w * w + x * x + y * y + z * z) - 1.0) <= LENGTH_TOLERANCE:
                return f"{names} must be of length 1, came {q}"
    return None


_CHECKS: dict[type[Message], Callable[[Any], str | None]] = {
    Info: _info,
    Status: _status,
    Skeleton: _skeleton,
    Calibration: _calibration,
    Session: _session,
}
