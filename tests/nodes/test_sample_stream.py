"""What is stated of a batch holds for each of its samples."""

from struct import pack

from brachium_nodes.batch_blocks import Measured
from brachium_nodes.node_frames import Batch
from brachium_nodes.sample_stream import Memory, SegmentMemory, stamp

HOST_NS = 1_700_000_000_000_000_000
STEP_US = 10_000
SAMPLES = 5


def at_ns(device_us: int) -> int:
    return HOST_NS + 1000 * device_us


def batch(memory: Memory, place: SegmentMemory, first_us: int, sequence: int) -> int:
    """Stamp a batch that arrives 30 ms after its last sample; return by how much its first time is off."""
    device_us = [first_us + STEP_US * k for k in range(SAMPLES)]
    offsets = pack(f"<{SAMPLES}I", *[STEP_US * k for k in range(SAMPLES)])
    measured = Measured(Batch(sequence=sequence, device_us=first_us, offsets=offsets), device_us)
    made = stamp(measured, memory, place, at_ns(device_us[-1] + 30_000))
    assert made is not None
    off = abs(made.time_ns - at_ns(first_us))
    assert off <= made.uncertainty_ns
    return off


def test_the_first_sample_of_a_batch_is_as_uncertain_as_is_stated_while_a_correction_fades() -> None:
    """The first question came at once and its answer took 16 ms; the second took as good as no time."""
    memory, place = Memory(boot=1), SegmentMemory()
    memory.clock.exchange(at_ns(1_000_000), 1_000_000, 1_000_000, at_ns(1_016_000))
    before = [batch(memory, place, 1_020_000 + SAMPLES * STEP_US * k, SAMPLES * k) for k in range(4)]
    memory.clock.exchange(at_ns(1_230_000), 1_230_000, 1_230_000, at_ns(1_230_002))
    after = [batch(memory, place, 1_240_000 + SAMPLES * STEP_US * k, SAMPLES * (4 + k)) for k in range(20)]
    assert min(before) > 7_900_000
    assert after[0] > 7_000_000, "a correction fades: time does not leap back"
    assert after[-1] < 500_000
