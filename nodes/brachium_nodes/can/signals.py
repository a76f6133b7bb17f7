"""Numbers out of a frame's bits, as a DBC places them; and quicker than decoding all of it. Pure."""

from collections.abc import Callable, Sequence
from struct import Struct
from typing import Any, Literal

Read = Callable[[bytes | bytearray], tuple[float, ...]]

_FLOAT = {32: (Struct("<I"), Struct("<f")), 64: (Struct("<Q"), Struct("<d"))}


class ShortFrame(ValueError):
    """A frame has fewer bytes than its message."""


def reader(message: Any, wanted: Sequence[tuple[str, float]]) -> Read:
    """Return what reads signals of a cantools message from a frame, each times a factor.

    Raises ValueError for a signal that is not always there (multiplexed), floats of half length, and signals
    of both byte orders.
    """
    length, places = message.length, []
    signals = {signal.name: signal for signal in message.signals}
    orders = {signals[name].byte_order for name, _ in wanted}
    if len(orders) != 1:
        raise ValueError(f"{message.name}: signals of both byte orders; those of one are read")
    little = orders == {"little_endian"}
    order: Literal["little", "big"] = "little" if little else "big"
    for name, factor in wanted:
        signal = signals[name]
        if signal.multiplexer_ids:
            raise ValueError(
                f"{message.name}: signal {name} is multiplexed; one that is always there is needed"
            )
        bits = signal.length
        if signal.is_float and bits not in _FLOAT:
            raise ValueError(f"{message.name}: signal {name} is a float of {bits} bits; 32 and 64 are read")
        # A big-endian signal's start is its highest bit, counted upwards within each byte.
        first = 8 * (signal.start // 8) + 7 - signal.start % 8
        shift = signal.start if little else 8 * length - first - bits
        sign = 1 << bits - 1 if signal.is_signed and not signal.is_float else 0
        scale, offset = float(signal.scale) * factor, float(signal.offset) * factor
        places.append((shift, (1 << bits) - 1, sign, scale, offset, signal.is_float))

    def read(data: bytes | bytearray) -> tuple[float, ...]:
        if len(data) != length:
            if len(data) < length:
                raise ShortFrame(f"{message.name} has {length} bytes; came {len(data)}")
            data = data[:length]
        whole = int.from_bytes(data, order)
        return tuple(
            [
                scale
                * (_float(whole >> shift & mask, mask) if is_float else (whole >> shift & mask ^ sign) - sign)
                + offset
                for shift, mask, sign, scale, offset, is_float in places
            ]
        )

    return read


def _float(raw: int, mask: int) -> float:
    whole, number = _FLOAT[mask.bit_length()]
    return float(number.unpack(whole.pack(raw))[0])
