"""Received, lost and out of order, counted from sequence numbers alone."""

from dataclasses import dataclass, field

MAX_HOLES = 256
"""Gaps that are remembered, so that what fills one is told from what comes twice."""


@dataclass(slots=True)
class SequenceCounter:
    """Counts the samples of one stream. `feed` says what each batch is; the fields are the totals."""

    received: int = 0
    lost: int = 0
    """Numbers that were passed over and did not come yet."""
    out_of_order: int = 0
    """Samples that came after a later one. They are received, and no longer lost."""
    repeated: int = 0
    """Samples that came although nothing was missing there."""
    next: int | None = None
    """The number that should come now; None before the first."""
    _holes: list[tuple[int, int]] = field(default_factory=list)
    """What is missing, [from, to), oldest first."""

    def feed(self, sequence: int, count: int) -> int:
        """Count a batch of `count` samples from `sequence` on.

        Returns the number of samples missing just before it (0 when it is the one expected), or -1 when it is not
        new: out of order or repeated.
        """
        if self.next is None:
            self.next = sequence
        gap = sequence - self.next
        if gap < 0:
            fills = self._fill(sequence, sequence + count)
            self.received += fills
            self.lost -= fills
            self.out_of_order += fills
            self.repeated += count - fills
            return -1
        self._miss(sequence)
        self.received += count
        self.next = sequence + count
        return gap

    def end(self, sequence: int) -> None:
        """Count what was lost at the very end: the node said that `sequence` would have come next."""
        if self.next is not None and sequence > self.next:
            self._miss(sequence)
            self.next = sequence

    def _miss(self, until: int) -> None:
        if self.next is not None and until > self.next:
            self.lost += until - self.next
            self._holes.append((self.next, until))
            del self._holes[:-MAX_HOLES]

    def _fill(self, start: int, end: int) -> int:
        filled, holes = 0, []
        for low, high in self._holes:
            first, last = max(low, start), min(high, end)
            if first >= last:
                holes.append((low, high))
                continue
            filled += last - first
            holes += [hole for hole in ((low, first), (last, high)) if hole[0] < hole[1]]
        self._holes = holes
        return filled
