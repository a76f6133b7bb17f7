"""The form of a skeleton's bytes: what is left of them without their numbers.

A message whose bytes are those of one that `decode` took, but for its numbers, holds the same fields, names
and words. So `decode` judges the first of each form; of the others only the numbers are looked at, many
messages at once and by the same rules.
"""

from collections.abc import Iterator
from typing import Union

import msgpack
import numpy as np
import numpy.typing as npt

from brachium_wire.codec import Drop, WireError
from brachium_wire.messages import Skeleton
from brachium_wire.plausible import LENGTH_TOLERANCE

Floats = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]
Mask = npt.NDArray[np.bool_]
Words = npt.NDArray[np.uint64]
Bytes = npt.NDArray[np.uint8]

Path = tuple[str | int | bytes, ...]
"""Where in a message a number stands, by names as on the wire: ("pos", "hand", 2)."""
_Tree = dict[str | int | bytes, Union[int, "_Tree"]]
"""The places of a message's numbers, in maps and lists as there."""

_KINDS: dict[int, str] = {
    0xCA: ">f4", 0xCB: ">f8",
    0xCC: ">u1", 0xCD: ">u2", 0xCE: ">u4", 0xCF: ">u8", 0xD0: ">i1", 0xD1: ">i2", 0xD2: ">i4", 0xD3: ">i8"
}  # fmt: skip
"""MessagePack's first bytes of numbers whose value is in the bytes that follow."""
_SMALL = 0x80
"""Below it, the first byte is itself the number."""
_NEGATIVE = 0xE0
"""From it on, the first byte less 256 is the number."""
_LARGEST = np.uint64((1 << 63) - 1)
_TIMES: tuple[Path, ...] = (("t",), ("rx",))
"""Too large for a double; of all other integers nothing but their size is asked."""
_DEPTH = 4
"""Maps and lists within one another in a skeleton's own fields; what is deeper is as in a form's first."""


def padded(payloads: list[bytes]) -> Words:
    """Return messages of one length as rows of whole words (n, w), zeros at their ends."""
    pad = bytes(-len(payloads[0]) % 8)
    return np.frombuffer(pad.join(payloads) + pad, dtype=np.uint64).reshape(len(payloads), -1)


class Form:
    """The skeletons that differ in nothing but their numbers, and the numbers of those that were taken."""

    def __init__(self, payload: bytes, example: Skeleton) -> None:
        """`example` is what `decode` made of `payload`. Raises WireError for one that is nested too deep."""
        found = dict(_flat(_tree(payload)))
        self.example = example
        self.columns: dict[Path, int] = {p: i for i, p in enumerate(p for p in found if p not in _TIMES)}
        self.integers: dict[Path, int] = {p: i for i, p in enumerate(p for p in found if p in _TIMES)}
        self.orders: list[Integers] = []
        self._floats: list[Floats] = []
        self._integers: list[Integers] = []
        self._place(payload, found)
        turns = dict.fromkeys(
            p[:-1] for p in self.columns if p[0] == "trunk" or (p[0] == "seg" and p[2] in ("q", "sq"))
        )
        self._turns = np.array([[self.columns[*path, i] for i in range(4)] for path in turns], dtype=np.intp)

    def _place(self, payload: bytes, found: dict[Path, int]) -> None:
        """Note each number's bytes; those that have none of their own are what they are in this message."""
        self._constant_floats = np.full(len(self.columns), np.nan)
        self._constant_integers = np.zeros(len(self.integers), dtype=np.int64)
        mask = np.full(len(payload), 0xFF, dtype=np.uint8)
        self._slots: list[tuple[bool, str, npt.NDArray[np.intp], npt.NDArray[np.intp]]] = []
        # Of floats or of integers, their kind, each one's bytes (k, size), and its column (k,).
        for floating, columns, constants in (
            (True, self.columns, self._constant_floats),
            (False, self.integers, self._constant_integers),
        ):
            places: dict[str, list[tuple[int, int]]] = {}
            for path, column in columns.items():
                at = found[path]
                first = payload[at]
                if first < _SMALL:
                    places.setdefault(">u1", []).append((at, column))
                    mask[at] = _SMALL  # any small number
                elif first >= _NEGATIVE:
                    constants[column] = first - 256
                else:
                    kind = _KINDS[first]
                    places.setdefault(kind, []).append((at + 1, column))
                    mask[at + 1 : at + 1 + np.dtype(kind).itemsize] = 0
            for kind, some in places.items():
                begin, column_ = np.array(some, dtype=np.intp).T
                bytes_ = begin[:, None] + np.arange(np.dtype(kind).itemsize)
                self._slots.append((floating, kind, bytes_, column_))
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


def _tree(payload: bytes) -> _Tree:
    """Return where the message's numbers stand. Raises WireError for one that is nested too deep.

    Of a name that a map holds twice the last one counts, as `decode` has it. What is no number is passed
    over: a field that is not known may hold anything.
    """
    unpacker = msgpack.Unpacker(raw=False, unicode_errors="surrogateescape")
    unpacker.feed(payload)

    def name() -> str | bytes:
        at = unpacker.tell()
        if 0xA0 <= payload[at] <= 0xBF or 0xD9 <= payload[at] <= 0xDB:
            return str(unpacker.unpack())
        unpacker.skip()
        return payload[at : unpacker.tell()]

    def inner(depth: int) -> "int | _Tree":
        at = unpacker.tell()
        first = payload[at]
        if depth and (0x80 <= first <= 0x8F or first in (0xDE, 0xDF)):
            return {name(): inner(depth - 1) for _ in range(unpacker.read_map_header())}
        if depth and (0x90 <= first <= 0x9F or first in (0xDC, 0xDD)):
            return {i: inner(depth - 1) for i in range(unpacker.read_array_header())}
        unpacker.skip()
        return at if first < _SMALL or first >= _NEGATIVE or first in _KINDS else {}

    try:
        found = inner(_DEPTH)
    except msgpack.StackError:
        raise WireError(Drop.MALFORMED, "nested too deep") from None
    assert isinstance(found, dict)
    return found


def _flat(tree: _Tree, path: Path = ()) -> Iterator[tuple[Path, int]]:
    for name, inner in tree.items():
        if isinstance(inner, dict):
            yield from _flat(inner, (*path, name))
        else:
            yield (*path, name), inner
