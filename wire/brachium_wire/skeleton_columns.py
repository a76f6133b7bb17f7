"""Skeletons as columns, from their bytes many at a time: a session has a hundred thousand of them.

What is taken and what is refused, and why, is what `decode` takes and refuses: see skeleton_forms.
"""

from collections import Counter
from collections.abc import Callable, Iterable
from copy import copy
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from brachium_wire.codec import WireError, decode_skeleton
from brachium_wire.messages import Skeleton
from brachium_wire.skeleton_forms import Floats, Form, Integers, Path, Words, padded
from brachium_wire.topics import TOPICS

BLOCK = 512
"""Messages looked at together: few enough to stay in the processor's cache."""
KEPT = 64
"""Forms of one length that a message is compared with, the latest. An arm's change with its quality."""


@dataclass(frozen=True, slots=True, eq=False)
class _Part:
    """What skeletons of one form hold, and their rows among all."""

    rows: Integers
    columns: dict[Path, int]
    floats: Floats


class SkeletonColumns:
    """n skeletons of one key in the order in which they came. What a skeleton does not hold is NaN."""

    def __init__(self, forms: Iterable[Form], arrived_ns: Iterable[int]) -> None:
        """Put the forms' skeletons in order; `arrived_ns` is of every message, also of those refused."""
        forms = [form for form in forms if form.orders]
        arrived = np.array([*arrived_ns], dtype=np.int64)
        tables = [form.tables() for form in forms]
        taken = np.zeros(len(arrived), dtype=np.bool_)
        for orders, _, _ in tables:
            taken[orders] = True
        row = np.cumsum(taken) - 1
        n = int(taken.sum())
        self.examples = tuple(form.example for form in forms)
        """One skeleton of each form: all of a form hold the same names and words."""
        self.form: npt.NDArray[np.intp] = np.zeros(n, dtype=np.intp)
        """(n,) which of `examples` each is like."""
        self.time_ns: Integers = np.zeros(n, dtype=np.int64)
        self.received_ns: Integers = np.zeros(n, dtype=np.int64)
        """(n,), to be read only where `received`."""
        self.arrived_ns: Integers = arrived[taken]
        """(n,) when each was recorded."""
        self._parts: list[_Part] = []
        for i, (form, (orders, floats, integers)) in enumerate(zip(forms, tables, strict=True)):
            rows = row[orders]
            self.form[rows] = i
            self.time_ns[rows] = integers[:, form.integers["t",]]
            if ("rx",) in form.integers:
                self.received_ns[rows] = integers[:, form.integers["rx",]]
            self._parts.append(_Part(rows, form.columns, floats))

    def __len__(self) -> int:
        return len(self.form)

    def on_clock(self, time_ns: Integers, kept: npt.NDArray[np.bool_]) -> "SkeletonColumns":
        """Return some of them at times put right: both (n,) as SteadyTimes holds them."""
        if kept.all() and (time_ns == self.time_ns).all():
            return self
        row = np.cumsum(kept) - 1
        found = copy(self)
        found.form, found.time_ns = self.form[kept], time_ns[kept]
        found.received_ns, found.arrived_ns = self.received_ns[kept], self.arrived_ns[kept]
        found._parts = [
            _Part(row[part.rows[there]], part.columns, part.floats[there])
            for part in self._parts
            if (there := kept[part.rows]).any()
        ]
        return found

    @property
    def last(self) -> Skeleton:
        """Return one of the last skeleton's form: its words hold, its numbers do not. Raises IndexError."""
        return self.examples[int(self.form[-1])]

    @property
    def received(self) -> npt.NDArray[np.bool_]:
        """Return where (n,) `received_ns` is known."""
        return self.each(lambda skeleton: skeleton.received_ns is not None, np.bool_)

    def each(self, word: Callable[[Skeleton], Any], kind: npt.DTypeLike | None = None) -> npt.NDArray[Any]:
        """Return (n,), of this kind, what is said of each skeleton by its names and words alone."""
        return np.array([word(example) for example in self.examples], dtype=kind)[self.form]

    def angles_rad(self, names: Iterable[str]) -> Floats:
        """Return the named angles (n, k)."""
        return self._floats([("ang", name) for name in names])

    def positions_m(self, joint: str) -> Floats:
        """Return a joint's positions (n, 3) in trunk axes."""
        return self._floats([("pos", joint, i) for i in range(3)])

    def shoulder_shift_m(self) -> Floats:
        """Return the shoulder's displacement (n, 3) in trunk axes."""
        return self._floats([("shift", i) for i in range(3)])

    def shoulder_shift_sd_m(self) -> Floats:
        """Return its standard deviation (n, 3) along trunk axes."""
        return self._floats([("shiftsd", i) for i in range(3)])

    def _floats(self, paths: list[Path]) -> Floats:
        out = np.full((len(self), len(paths)), np.nan)
        for part in self._parts:
            held = [(k, part.columns[path]) for k, path in enumerate(paths) if path in part.columns]
            if held:
                there, columns = np.array(held, dtype=np.intp).T
                out[part.rows[:, None], there] = part.floats[:, columns]
        return out


class SkeletonCollector:
    """Takes one key's skeletons as they come; what is no skeleton is refused, and counted by its reason."""

    def __init__(self) -> None:
        self.refused: Counter[str] = Counter()
        self._max_bytes = TOPICS["skeleton"].max_bytes
        self._waiting: list[bytes] = []
        self._arrived: list[int] = []
        self._forms: list[Form] = []
        self._latest: dict[int, list[Form]] = {}

    def take(self, payload: bytes, arrived_ns: int) -> None:
        """Take one message."""
        self._waiting.append(payload)
        self._arrived.append(arrived_ns)
        if len(self._waiting) == BLOCK:
            self._settle()

    def columns(self) -> SkeletonColumns:
        """Return all that came so far; `refused` is then final for these."""
        self._settle()
        return SkeletonColumns(self._forms, self._arrived)

    def _settle(self) -> None:
        """Look at what waits: all messages of one length together."""
        first = len(self._arrived) - len(self._waiting)
        alike: dict[int, list[int]] = {}
        for i, payload in enumerate(self._waiting):
            alike.setdefault(len(payload), []).append(i)
        for length, which in alike.items():
            some = [self._waiting[i] for i in which]
            if length == 0 or length > self._max_bytes:
                for payload in some:
                    self._begin(payload, 0)
            else:
                self._sort(some, np.array(which, dtype=np.int64) + first)
        self._waiting = []

    def _sort(self, payloads: list[bytes], orders: Integers) -> None:
        """Give messages of one length to their forms."""
        rows = padded(payloads)
        left = np.arange(len(payloads))
        while len(left):
            form = self._known(len(payloads[0]), rows[left[:1]])
            if form is None:
                self._begin(payloads[left[0]], int(orders[left[0]]))
                left = left[1:]
                continue
            same = form.matches(rows[left])
            found = left[same]
            sound = form.take(rows[found], orders[found])
            for i in found[~sound].tolist():
                self._begin(payloads[i], int(orders[i]))
            left = left[~same]

    def _known(self, length: int, row: Words) -> Form | None:
        return next((form for form in reversed(self._latest.get(length, [])) if form.matches(row)[0]), None)

    def _begin(self, payload: bytes, order: int) -> None:
        """Take a message that is of no form yet, or count why it is none."""
        try:
            form = Form(payload, decode_skeleton(payload, self._max_bytes))
        except WireError as error:
            self.refused[error.drop.value] += 1
            return
        form.take(padded([payload]), np.array([order], dtype=np.int64), judged=True)
        self._forms.append(form)
        latest = self._latest.setdefault(len(payload), [])
        latest.append(form)
        del latest[:-KEPT]
