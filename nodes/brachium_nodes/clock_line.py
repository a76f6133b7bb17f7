"""The line between points above and points below it: each side keeps only those that a line can touch."""

from bisect import bisect_left
from collections import deque
from itertools import islice, pairwise

Point = tuple[int, int]

BLOCK_US = 10_000_000
"""Old points are forgotten in blocks of this length: what hid behind them may then be touched."""


class Below:
    """The lower edge of points (x us, y ns) that come with growing x, over a window that moves along.

    No line is steeper than `steepest`, ns per us, either way.
    """

    def __init__(self, steepest: float) -> None:
        self._steepest = steepest
        self._blocks: deque[list[Point]] = deque()
        self._sums: deque[list[int]] = deque()  # of each block: points, and the sum of their x
        self._older: list[Point] | None = None  # the edge of all blocks but the last, once it was asked for
        self._block = 0
        self._first: int | None = None
        self._last = 0

    def __bool__(self) -> bool:
        return bool(self._blocks)

    @property
    def newest(self) -> int:
        """The largest x that came."""
        return self._last

    @property
    def span(self) -> int:
        """From the first to the last x in the window."""
        return 0 if self._first is None else self._last - self._first

    @property
    def size(self) -> int:
        """How many points are kept."""
        return sum(map(len, self._blocks))

    @property
    def middle(self) -> float:
        """The mean x of all points in the window, kept or not."""
        return sum(x for _, x in self._sums) / max(sum(n for n, _ in self._sums), 1)

    def add(self, x: int, y: int) -> None:
        """Take a point; one that lies before the last is left out."""
        if self._blocks and x < self._last:
            return
        self._last = x
        block = x // BLOCK_US
        if not self._blocks or block != self._block:
            self._block = block
            self._blocks.append([(x, y)])
            self._sums.append([1, x])
            self._older = None
            if self._first is None:
                self._first = x
            return
        sums, corners = self._sums[-1], self._blocks[-1]
        sums[0] += 1
        sums[1] += x
        last_x, last_y = corners[-1]
        if y - last_y < self._steepest * (x - last_x) or x == last_x:  # else no line can touch it
            _extend(corners, (x, y))

    def forget(self, before: int) -> None:
        """Forget the blocks that end before this x."""
        while self._blocks and (self._blocks[0][-1][0] // BLOCK_US + 1) * BLOCK_US <= before:
            self._blocks.popleft()
            self._sums.popleft()
            self._older = None
            self._first = self._blocks[0][0][0] if self._blocks else None

    def edge(self) -> list[Point]:
        """Return the corners of the lower edge, by x."""
        if self._older is None:
            self._older = []
            for block in islice(self._blocks, max(len(self._blocks) - 1, 0)):
                for point in block:
                    _extend(self._older, point)
        edge = self._older.copy()
        for point in self._blocks[-1] if self._blocks else ():
            _extend(edge, point)
        return edge


def _extend(edge: list[Point], point: Point) -> None:
    """Add a point at the right of a lower edge."""
    x, y = point
    if edge and edge[-1][0] == x:
        if edge[-1][1] <= y:
            return
        edge.pop()
    while len(edge) > 1:
        (x0, y0), (x1, y1) = edge[-2], edge[-1]
        if (y1 - y0) * (x - x0) < (y - y0) * (x1 - x0):
            break
        edge.pop()
    edge.append(point)


def between(above: Below, minus_below: Below, steepest: float) -> tuple[float, float, float]:
    """Return intercept, slope and gap of the middle line between points above it and points below it.

    `minus_below` holds the points below with their y negated. For a slope b the upper line touches at
    min(y - b x), the lower at max(y - b x); the sum of all gaps, each side weighted alike, is convex in b and
    has its least at a slope of either edge, or at +-`steepest`. The gap is negative when no line keeps the
    two apart.
    """
    upper, lower = above.edge(), minus_below.edge()
    upper_slopes, lower_slopes = _slopes(upper), _slopes(lower)
    lean = above.middle - minus_below.middle

    def grows(b: float) -> float:
        """How the negative sum of gaps grows with the slope at b, which is no slope of an edge."""
        return lower[bisect_left(lower_slopes, -b)][0] - upper[bisect_left(upper_slopes, b)][0] + lean

    inside = {b for b in (*upper_slopes, *(-b for b in lower_slopes)) if -steepest < b < steepest}
    slopes = [-steepest, *sorted(inside), steepest]
    low, high = 0, len(slopes) - 1
    while low < high:
        middle = (low + high) // 2
        if grows((slopes[middle] + slopes[middle + 1]) / 2) > 0.0:
            low = middle + 1
        else:
            high = middle
    b = slopes[low]
    x, y = upper[min(bisect_left(upper_slopes, b), len(upper) - 1)]
    top = y - b * x
    x, y = lower[min(bisect_left(lower_slopes, -b), len(lower) - 1)]
    bottom = -y - b * x
    return (top + bottom) / 2, b, top - bottom


def _slopes(edge: list[Point]) -> list[float]:
    return [(y1 - y0) / (x1 - x0) for (x0, y0), (x1, y1) in pairwise(edge)]
