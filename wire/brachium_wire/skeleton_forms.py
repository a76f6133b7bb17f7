"""The form of a skeleton's bytes: what is left of them without their numbers.

A message whose bytes are those of one that `decode` took, but for its numbers, holds the same fields, names
and words. So `decode` judges the first of each form; of the others only the numbers are looked at, many
messages at once and by the same rules.
"""

from collections.abc import Iterator
from typing import Any, Literal

import msgpack
import numpy as np
import numpy.typing as npt

from brachium_wire.messages import Skeleton
from brachium_wire.plausible import LENGTH_TOLERANCE

Floats = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]
Mask = npt.NDArray[np.bool_]
Words = npt.NDArray[np.uint64]
Bytes = npt.NDArray[np.uint8]

Path = tuple[str | int, ...]
"""Where in a message a number stands, by names as on the wire: ("pos", "hand", 2)."""

# MessagePack's first bytes of numbers whose value is in the bytes that follow.
_FLOAT: dict[int, str] = {0xCA: ">f4", 0xCB: ">f8"}
_INTEGER: dict[int, str] = {
    0xCC: ">u1", 0xCD: ">u2", 0xCE: ">u4", 0xCF: ">u8", 0xD0: ">i1", 0xD1: ">i2", 0xD2: ">i4", 0xD3: ">i8"
}  # fmt: skip
_SMALL = 0x80
"""Below it, the first byte is itself the number."""
_LARGEST = np.uint64((1 << 63) - 1)


def padded(payloads: list[bytes]) -> Words:
    """Return messages of one length as rows of whole words (n, w), zeros at their ends."""
    pad = bytes(-len(payloads[0]) % 8)
    return np.frombuffer(pad.join(payloads) + pad, dtype=np.uint64).reshape(len(payloads), -1)


class Form:
    """The skeletons that differ in nothing but their numbers, and the numbers of those that were taken."""

    def __init__(self, payload: bytes, example: Skeleton) -> None:
        """`example` is what `decode` made of `payload`."""
        self.example = example
        self.columns: dict[Path, int] = {path: i for i, path in enumerate(_float_paths(example))}
        self.integers: dict[Path, int] = {path: i for i, path in enumerate(_integer_paths(example))}
        self.orders: list[Integers] = []
        self._floats: list[Floats] = []
        self._integers: list[Integers] = []
        self._numbers(payload)
        self._turns = np.array(
            [
                [self.columns[*path, i] for i in range(4)]
                for path in dict.fromkeys(p[:-1] for p in self.columns if p[0] in ("trunk", "seg"))
            ],
            dtype=np.intp,
        )

    def _numbers(self, payload: bytes) -> None:
        """Find each number's place; those that have none of their own are what they are in this message."""
        self._constant_floats = np.full(len(self.columns), np.nan)
        self._constant_integers = np.zeros(len(self.integers), dtype=np.int64)
        mask = np.full(len(payload), 0xFF, dtype=np.uint8)
        found = dict(_walk(payload))
        self._slots: list[tuple[bool, str, npt.NDArray[np.intp], npt.NDArray[np.intp]]] = []
        # Of floats or of integers, their kind, each one's bytes (k, size), and its column (k,).
        for columns, constants, kinds in (
            (self.columns, self._constant_floats, _FLOAT),
            (self.integers, self._constant_integers, _INTEGER),
        ):
            places: dict[str, list[tuple[int, int]]] = {}
            for path, column in columns.items():
                at, value = found[path]
                if payload[at] < _SMALL:
                    places.setdefault(">u1", []).append((at, column))
                    mask[at] = _SMALL  # any small number
                elif (kind := kinds.get(payload[at])) is not None:
                    places.setdefault(kind, []).append((at + 1, column))
                    mask[at + 1 : at + 1 + np.dtype(kind).itemsize] = 0
                else:
                    constants[column] = value
            for kind, some in places.items():
                first, column_ = np.array(some, dtype=np.intp).T
                bytes_ = first[:, None] + np.arange(np.dtype(kind).itemsize)
                self._slots.append((kinds is _FLOAT, kind, bytes_, column_))
        self._mask = padded([mask.tobytes()])[0]
        self._fixed = padded([payload])[0] & self._mask

    def matches(self, rows: Words) -> Mask:
        """Return which messages (n, w) are of this form."""
        return np.asarray(((rows & self._mask) == self._fixed).all(axis=1))

    def take(self, rows: Words, orders: Integers, *, judged: bool = False) -> Mask:
        """Take messages (n, w) of this form, which came in these orders (n,); return which were sound (n,).

        Those that are not are left out: `decode` says why. `judged`: it has looked at them.
        """
        data = rows.view(np.uint8)
        floats = np.tile(self._constant_floats, (len(rows), 1))
        integers = np.tile(self._constant_integers, (len(rows), 1))
        sound = np.ones(len(rows), dtype=np.bool_)
        for floating, kind, at, columns in self._slots:
            values = data.take(at, axis=1).view(kind)[..., 0]
            if kind == ">u8":
                sound &= (values <= _LARGEST).all(axis=1)
            (floats if floating else integers)[:, columns] = values
        sound &= np.isfinite(floats).all(axis=1) & _of_length_one(floats[:, self._turns])
        sound |= judged
        self.orders.append(orders[sound])
        self._floats.append(floats[sound])
        self._integers.append(integers[sound])
        return sound

    def tables(self) -> tuple[Integers, Floats, Integers]:
        """Return what was taken: orders (n,), floats (n, columns) and integers (n, integers)."""
        return np.concatenate(self.orders), np.concatenate(self._floats), np.concatenate(self._integers)


def _of_length_one(turns: Floats) -> Mask:
    """Return where all quaternions (n, k, 4) have the length that plausible.fault asks for."""
    with np.errstate(over="ignore", invalid="ignore"):
        w, x, y, z = np.moveaxis(turns, -1, 0)
        off = np.abs(np.sqrt(w * w + x * x + y * y + z * z) - 1.0)
    return np.asarray((off <= LENGTH_TOLERANCE).all(axis=1))


def _float_paths(skeleton: Skeleton) -> Iterator[Path]:
    turns: list[Path] = [("trunk",)]
    for name, pose in skeleton.segments.items():
        turns += [("seg", name, "q")] if pose.world_from_segment is not None else []
        turns += [("seg", name, "sq")] if pose.world_from_sensor is not None else []
    vectors: list[Path] = [("pos", joint) for joint in skeleton.positions]
    vectors += [("shift",)] if skeleton.shoulder_shift is not None else []
    vectors += [("shiftsd",)] if skeleton.shoulder_shift_sd is not None else []
    yield from ((*path, i) for path in turns for i in range(4))
    yield from ((*path, i) for path in vectors for i in range(3))
    yield from (("ang", name) for name in skeleton.angles)
    yield from (("angsd", name) for name in skeleton.angle_sd)


def _integer_paths(skeleton: Skeleton) -> Iterator[Path]:
    yield ("t",)
    if skeleton.received_ns is not None:
        yield ("rx",)
    for name, pose in skeleton.segments.items():
        if pose.sequence is not None:
            yield ("seg", name, "seq")


def _walk(payload: bytes) -> Iterator[tuple[Path, tuple[int, Any]]]:
    """Yield each value that is neither map nor list: where it stands, its first byte's place, and itself.

    Of a name that a map holds twice the last one counts, as `decode` has it.
    """
    unpacker = msgpack.Unpacker(raw=False)
    unpacker.feed(payload)

    def inner(path: Path) -> Iterator[tuple[Path, tuple[int, Any]]]:
        at = unpacker.tell()
        match _kind(payload[at]):
            case "map":
                for _ in range(unpacker.read_map_header()):
                    yield from inner((*path, unpacker.unpack()))
            case "list":
                for i in range(unpacker.read_array_header()):
                    yield from inner((*path, i))
            case _:
                yield path, (at, unpacker.unpack())

    return inner(())


def _kind(first: int) -> Literal["map", "list", "value"]:
    if 0x80 <= first <= 0x8F or first in (0xDE, 0xDF):
        return "map"
    return "list" if 0x90 <= first <= 0x9F or first in (0xDC, 0xDD) else "value"
