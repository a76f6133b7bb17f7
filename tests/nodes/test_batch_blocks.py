"""A node's batch in SI: what is believed is judged by numpy here, number by number."""

from struct import pack

import msgspec
import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from brachium_nodes.batch_blocks import measure
from brachium_nodes.node_frames import Batch, Hello, Scales
from brachium_wire.codec import Drop, WireError
from brachium_wire.samples import MAX_ACC, MAX_GYR, MAX_MAG

HELLO = Hello(node="n", boot=1, chip="MPU-9150", rate_hz=100.0, magnetometer=True)
BITS = st.integers(0, (1 << 32) - 1)
USUAL = st.floats(-200.0, 200.0, width=32).map(lambda x: int.from_bytes(pack("<f", x), "little"))


def batch(acc: bytes, gyr: bytes, mag: bytes | None = None, index: bytes | None = None) -> Batch:
    n = len(acc) // 12
    offsets = pack(f"<{n}I", *range(0, 10_000 * n, 10_000))
    return Batch(sequence=7, device_us=1, offsets=offsets, acc=acc, gyr=gyr, mag=mag, mag_index=index)


def drop_of(frame: Batch) -> Drop | None:
    try:
        measure(frame, HELLO)
    except WireError as error:
        return error.drop
    return None


def expected(*blocks: tuple[bytes, float]) -> set[Drop | None]:
    """What may be said of blocks with these limits; which of two faults is named first is not promised."""
    said: set[Drop | None] = set()
    for block, limit in blocks:
        numbers = np.frombuffer(block, dtype="<f4").astype(float)
        if not np.isfinite(numbers).all():
            said.add(Drop.NOT_FINITE)
        elif (np.abs(numbers) > limit).any():
            said.add(Drop.OUT_OF_RANGE)
    return said or {None}


@given(st.lists(USUAL | BITS, min_size=9, max_size=9), st.integers(1, 5))
@example([0x42C80000] * 9, 1)  # 100, the largest of a gyroscope
@example([0xC2C80000] * 9, 3)
@example([0x42C80001] * 9, 2)  # the next float32
@example([0] * 8 + [0x7FC00000], 1)  # NaN
@example([0] * 8 + [0xFF800000], 4)  # minus infinity
def test_each_number_is_believed_or_not_as_numpy_says(bits: list[int], n: int) -> None:
    acc, gyr, mag = (pack("<3I", *bits[k : k + 3]) * n for k in (0, 3, 6))
    frame = batch(acc, gyr, mag)
    assert drop_of(frame) in expected((acc, MAX_ACC), (gyr, MAX_GYR), (mag, MAX_MAG))


@pytest.mark.parametrize(
    ("index", "drop"),
    [
        ([0], None),
        ([2, 4], None),
        ([], Drop.WRONG_SHAPE),
        ([5], Drop.WRONG_SHAPE),
        ([2, 2], Drop.WRONG_SHAPE),
    ],
)
def test_a_slower_magnetometer_names_its_samples(index: list[int], drop: Drop | None) -> None:
    still = bytes(60)
    frame = batch(still, still, bytes(12 * len(index)), pack(f"<{len(index)}H", *index))
    assert drop_of(frame) is drop
    assert drop_of(frame) is drop  # and again when the same comes once more


@pytest.mark.parametrize(
    ("offsets", "drop"),
    [
        ([0, 10, 20], None),
        ([0, 10, 10], Drop.TIME_BACKWARDS),
        ([1, 10, 20], Drop.TIME_BACKWARDS),
        ([0, 10, 4_000_001], Drop.TIME_BACKWARDS),
        ([], Drop.WRONG_SHAPE),
    ],
)
def test_times_begin_with_0_and_grow(offsets: list[int], drop: Drop | None) -> None:
    block = pack(f"<{len(offsets)}I", *offsets)
    frame = msgspec.structs.replace(batch(bytes(36), bytes(36)), offsets=block)
    for _ in range(2):
        assert drop_of(frame) is drop
    if drop is None:
        assert measure(frame, HELLO).device_us == [1 + offset for offset in offsets]


@given(st.lists(st.integers(-(1 << 15), (1 << 15) - 1), min_size=6, max_size=6), st.booleans())
def test_steps_become_si(steps: list[int], big_endian: bool) -> None:
    order = ">" if big_endian else "<"
    acc, gyr = (pack(f"{order}3h", *steps[k : k + 3]) for k in (0, 3))
    acc_scale, gyr_scale = (0.01, 0.001, -0.01), (0.001, 0.002, 0.003)
    scales = Scales(acc=acc_scale, gyr=gyr_scale)
    hello = msgspec.structs.replace(HELLO, scales=scales, big_endian=big_endian)
    frame = msgspec.structs.replace(batch(bytes(12), bytes(12)), acc=acc, gyr=gyr)
    made = measure(frame, hello).batch
    for block, raw, scale in ((made.acc, steps[:3], acc_scale), (made.gyr, steps[3:], gyr_scale)):
        assert block is not None
        assert np.frombuffer(block, dtype="<f4") == pytest.approx(np.multiply(raw, scale), rel=1e-6)
