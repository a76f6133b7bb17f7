"""From a node's numbers and clock to those of its segment on the bus: host times, and counts that go on."""

from collections import Counter
from dataclasses import dataclass, field
from struct import pack

from brachium_nodes.batch_blocks import Measured
from brachium_nodes.clock import NodeClock
from brachium_wire.codec import Drop, WireError
from brachium_wire.messages import SampleBatch
from brachium_wire.sequence import SequenceCounter

MAX_AHEAD_NS = 1_000_000_000
"""A sample this far in the future has a broken clock."""


@dataclass(slots=True)
class Memory:
    """What is kept of a node over its connections, as long as it does not restart."""

    boot: int
    counter: SequenceCounter = field(default_factory=SequenceCounter)
    clock: NodeClock = field(default_factory=NodeClock)
    drops: Counter[str] = field(default_factory=Counter)
    late: int = 0
    newest_us: int = -1
    """Device time of the newest sample in order."""
    base: int | None = None
    """What is added to the node's numbers, so that the segment's go on when another node takes over."""


@dataclass(slots=True)
class SegmentMemory:
    """What a segment's key has carried so far; numbers and times on it never go back."""

    next_sequence: int = 0
    newest_ns: int = 0


def stamp(measured: Measured, memory: Memory, place: SegmentMemory, received_ns: int) -> SampleBatch | None:
    """Return a batch with host times and the segment's numbers, and count it; None when all of it was here.

    Raises WireError for times that cannot be: then nothing is counted.
    """
    batch, device_us = measured.batch, measured.device_us
    clock, counter, samples, newest_us = memory.clock, memory.counter, len(device_us), device_us[-1]
    in_order = not batch.late and (counter.next is None or batch.sequence >= counter.next)
    if in_order and device_us[0] <= memory.newest_us:
        raise WireError(Drop.TIME_BACKWARDS, f"batch/1: t {batch.device_us} is not after the sample before")
    if not clock.known:
        clock.arrival(newest_us, received_ns)
    times = clock.host_times(device_us)
    # While a correction fades the first sample is the less certain one; none between is less than both.
    uncertainty_ns = max(clock.uncertainty_ns(device_us[0]), clock.uncertainty_ns(newest_us))
    if times[0] <= 0 or times[-1] > received_ns + uncertainty_ns + MAX_AHEAD_NS:
        raise WireError(Drop.OUT_OF_RANGE, f"batch/1: t {batch.device_us} lies in the future")
    if in_order:
        clock.publish(newest_us)
    clock.arrival(newest_us, received_ns)
    repeated = counter.repeated
    counter.feed(batch.sequence, samples)
    if counter.repeated > repeated:
        memory.drops[Drop.REPEATED.value] += counter.repeated - repeated
        if counter.repeated - repeated == samples:
            return None
    if batch.late:
        memory.late += samples
    if memory.base is None:
        memory.base = max(0, place.next_sequence - batch.sequence)
    sequence = batch.sequence + memory.base
    if in_order:
        memory.newest_us = newest_us
        if times[0] <= place.newest_ns:  # another node or boot was here before
            times = [t + place.newest_ns + 1 - times[0] for t in times]
        place.newest_ns, place.next_sequence = times[-1], sequence + samples
    first_ns = times[0]
    return SampleBatch(
        sequence=sequence,
        time_ns=first_ns,
        offsets=pack(f"<{samples}I", *[t - first_ns for t in times]),
        device_us=batch.device_us,
        device_offsets=batch.offsets,
        received_ns=received_ns,
        uncertainty_ns=uncertainty_ns,
        acc=batch.acc,
        gyr=batch.gyr,
        mag=batch.mag,
        mag_index=batch.mag_index,
        quat=batch.quat,
        late=batch.late,
    )
