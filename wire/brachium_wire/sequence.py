"""Received, lost and out of order, counted from sequence numbers alone."""

from dataclasses import dataclass, field

MAX_GAPS = 1024
"""Gaps that are remembered; what comes late into an older one counts as repeated, and stays lost."""


@dataclass(slots=True)
class SequenceCounter:
    """Counts the samples of one stream. `feed` says what each batch is; the fields are the totals.

    Without `next` the first batch that comes sets the start: nothing before it can be lost, and a batch from
    before it is `repeated`. Give `next=0` for a stream known to begin with 0: the counts are exact from it.
    """

    received: int = 0
    """Samples that came, each number once."""
    lost: int = 0
    """Numbers that were passed over and did not come yet."""
    out_of_order: int = 0
    """Samples that came after a later one. They are received, and no longer lost."""
    repeated: int = 0
    """Samples that came although nothing was missing there."""
    next: int | None = None
    """The number that should come now; None before the first."""
    gaps: list[tuple[int, int]] = field(default_factory=list)
    """What is lost, as [first, end) in ascending order."""

    def feed(self, sequence: int, count: int) -> int:
        """Count a batch of `count` samples from `sequence` on.

        Returns the number of samples missing just before it (0 when it is the one expected), or -1 when it
        begins before the one expected: out of order or repeated. Nothing of it beyond `next` is taken.
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
        self.received += count
        if gap:
            self._miss(sequence)
        self.next = sequence + count
        return gap

    def begin_again(self, sequence: int) -> None:
        """The sender began to number anew, with `sequence`: what was lost before stays lost."""
        self.next = sequence
        self.gaps = []

    def end(self, sequence: int) -> None:
        """Count what was lost at the very end: the node said that `sequence` would have come next."""
        if self.next is not None and sequence > self.next:
            self._miss(sequence)
            self.next = sequence

    def _miss(self, until: int) -> None:
        assert self.next is not None
        if until > self.next:
            self.lost += until - self.next
            self.gaps.append((self.next, until))
            del self.gaps[:-MAX_GAPS]

    def _fill(self, first: int, end: int) -> int:
        """Take [first, end) out of the gaps and return how many numbers that were."""
        kept: list[tuple[int, int]] = []
        fills = 0
        for a, b in self.gaps:
            low, high = max(a, first), min(b, end)
            if low >= high:
                kept.append((a, b))
                continue
            fills += high - low
            kept += [part for part in ((a, low), (high, b)) if part[0] < part[1]]
        self.gaps = kept
        return fills
