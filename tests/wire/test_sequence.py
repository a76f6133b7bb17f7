"""Losses counted from numbers alone, against a model that knows what was sent."""

from hypothesis import given
from hypothesis import strategies as st

from brachium_wire.sequence import MAX_GAPS, SequenceCounter

COUNTS = st.lists(st.integers(1, 12), min_size=1, max_size=40)


def batches(counts: list[int]) -> list[tuple[int, int]]:
    out, first = [], 0
    for count in counts:
        out.append((first, count))
        first += count
    return out


@given(COUNTS, st.data())
def test_exact_under_any_loss_and_swaps_of_neighbours(counts: list[int], data: st.DataObject) -> None:
    sent = batches(counts)
    keep = data.draw(st.lists(st.booleans(), min_size=len(sent), max_size=len(sent)))
    way = [batch for batch, kept in zip(sent, keep, strict=True) if kept]
    swapped, position = 0, 0
    while position + 1 < len(way):
        if data.draw(st.booleans()):
            way[position], way[position + 1] = way[position + 1], way[position]
            swapped += way[position + 1][1]
            position += 2
        else:
            position += 1
    counter = SequenceCounter(next=0)
    for first, count in way:
        counter.feed(first, count)
    total = sum(counts)
    counter.end(total)
    received = sum(count for _, count in way)
    assert (counter.received, counter.lost) == (received, total - received)
    assert (counter.out_of_order, counter.repeated) == (swapped, 0)


@given(COUNTS, st.data())
def test_exact_under_any_order_and_repetition(counts: list[int], data: st.DataObject) -> None:
    sent = batches(counts)
    way = data.draw(st.lists(st.sampled_from(sent), min_size=1, max_size=60))
    counter = SequenceCounter(next=0)
    seen: set[int] = set()
    late = repeated = 0
    for first, count in way:
        numbers = set(range(first, first + count))
        highest = max(seen, default=-1)
        new = numbers - seen
        repeated += len(numbers & seen)
        late += sum(number < highest for number in new)
        gap = counter.feed(first, count)
        assert gap == (-1 if first <= highest else first - highest - 1)
        seen |= numbers
    assert counter.received == len(seen)
    assert counter.lost == max(seen) + 1 - len(seen)
    assert (counter.out_of_order, counter.repeated) == (late, repeated)
    assert sum(end - first for first, end in counter.gaps) == counter.lost


def test_without_a_known_start_the_first_batch_begins_the_count() -> None:
    counter = SequenceCounter()
    assert counter.feed(1000, 5) == 0
    assert counter.feed(1010, 5) == 5
    assert counter.feed(990, 5) == -1
    assert (counter.received, counter.lost, counter.out_of_order, counter.repeated) == (10, 5, 0, 5)


def test_a_batch_that_reaches_beyond_the_next_number_gives_nothing_new() -> None:
    counter = SequenceCounter(next=0)
    counter.feed(0, 10)
    assert counter.feed(8, 5) == -1
    assert (counter.received, counter.repeated, counter.next) == (10, 5, 10)


def test_the_end_says_what_was_lost_last_and_never_goes_back() -> None:
    counter = SequenceCounter()
    counter.end(50)
    assert counter.lost == 0
    counter.feed(0, 10)
    counter.end(15)
    counter.end(12)
    assert (counter.received, counter.lost, counter.next) == (10, 5, 15)


def test_gaps_kept_in_mind_are_bounded_and_losses_are_not_forgotten() -> None:
    counter = SequenceCounter(next=0)
    for number in range(MAX_GAPS + 500):
        counter.feed(2 * number + 1, 1)
    assert len(counter.gaps) == MAX_GAPS
    assert counter.lost == MAX_GAPS + 500
    counter.feed(0, 1)
    assert (counter.repeated, counter.lost) == (1, MAX_GAPS + 500)
