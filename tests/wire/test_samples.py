"""Blocks of numbers: what goes in comes out, and each fault has its name."""

import struct
from typing import Any

import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from brachium_wire.codec import Drop, WireError, decode, encode
from brachium_wire.messages import SampleBatch
from brachium_wire.samples import (
    MAX_ACC,
    MAX_GYR,
    MAX_MAG,
    MAX_SAMPLES,
    MAX_SPAN_NS,
    read_many,
    read_samples,
    write_samples,
)

T0 = 1_790_000_000_000_000_000


def batch(n: int = 3, **changes: Any) -> SampleBatch:
    made = write_samples(
        sequence=7,
        time_ns=T0 + 10_000_000 * np.arange(n),
        device_us=5_000_000 + 10_000 * np.arange(n),
        received_ns=T0 + 40_000_000,
        uncertainty_ns=1000,
        acc=np.tile([0.0, 9.81, 0.1], (n, 1)),
        gyr=np.tile([0.5, 0.0, -0.5], (n, 1)),
        mag=np.tile([20.0, 0.0, -40.0], (n, 1)),
    )
    return msgspec.structs.replace(made, **changes)


def floats(*values: float) -> bytes:
    return struct.pack(f"<{len(values)}f", *values)


@st.composite
def drawn(draw: st.DrawFn) -> dict[str, Any]:
    n = draw(st.integers(1, MAX_SAMPLES))
    seed = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    steps = seed.integers(1, MAX_SPAN_NS // MAX_SAMPLES, n)
    device = seed.integers(0, 1_000_000, n)
    out: dict[str, Any] = {
        "sequence": draw(st.integers(0, (1 << 62) - 1)),
        "time_ns": draw(st.integers(1, 1 << 61)) + np.cumsum(steps) - steps[0],
        "device_us": draw(st.integers(0, 1 << 61)) + np.cumsum(device) - device[0],
        "received_ns": draw(st.integers(1, (1 << 62) - 1)),
        "uncertainty_ns": draw(st.integers(0, (1 << 62) - 1)),
        "late": draw(st.booleans()),
    }
    if draw(st.booleans()):
        quat = seed.normal(size=(n, 4))
        out["quat"] = quat / np.linalg.norm(quat, axis=1)[:, None]
    if "quat" not in out or draw(st.booleans()):
        out["acc"] = seed.uniform(-MAX_ACC, MAX_ACC, (n, 3)).astype(np.float32)
        out["gyr"] = seed.uniform(-MAX_GYR, MAX_GYR, (n, 3)).astype(np.float32)
        rows = draw(st.integers(0, n))
        if rows:
            out["mag"] = seed.uniform(-MAX_MAG, MAX_MAG, (rows, 3)).astype(np.float32)
        if 0 < rows < n:
            out["mag_index"] = np.sort(seed.choice(n, rows, replace=False))
    return out


@given(drawn())
def test_arrays_come_back_through_the_bytes(arrays: dict[str, Any]) -> None:
    payload = encode(write_samples(**arrays))
    samples = read_samples(decode(payload, SampleBatch))
    n = len(arrays["time_ns"])
    assert len(samples) == n
    assert samples.time_ns == [int(t) for t in arrays["time_ns"]]
    offsets = struct.unpack(f"<{n}I", samples.device_offsets)
    assert [samples.device_us + offset for offset in offsets] == [int(t) for t in arrays["device_us"]]
    for name in ("sequence", "received_ns", "uncertainty_ns", "late"):
        assert getattr(samples, name) == arrays[name]
    for name in ("acc", "gyr", "mag"):
        got, sent = getattr(samples, name), arrays.get(name)
        assert (got is None) == (sent is None)
        if sent is not None:
            assert got.dtype == np.float64
            np.testing.assert_array_equal(got, sent.astype(np.float64))
    expected = arrays.get("mag_index")
    assert samples.mag_index == (None if expected is None else tuple(int(i) for i in expected))
    if "quat" in arrays:
        assert samples.quat is not None
        np.testing.assert_allclose(samples.quat, arrays["quat"], atol=1e-6)
        np.testing.assert_allclose(np.linalg.norm(samples.quat, axis=1), 1.0, atol=1e-12)
    else:
        assert samples.quat is None


def test_blocks_are_little_endian_rows_one_after_another() -> None:
    made = batch(2)
    assert made.acc == floats(0.0, 9.81, 0.1, 0.0, 9.81, 0.1)
    assert made.offsets == b"\x00\x00\x00\x00\x80\x96\x98\x00"
    assert made.device_offsets == b"\x00\x00\x00\x00\x10\x27\x00\x00"


NAN, INF = float("nan"), float("inf")
FAULTS: list[tuple[str, dict[str, Any], Drop]] = [
    ("seq negative", {"sequence": -1}, Drop.OUT_OF_RANGE),
    ("seq too large", {"sequence": 1 << 62}, Drop.OUT_OF_RANGE),
    ("t zero", {"time_ns": 0}, Drop.OUT_OF_RANGE),
    ("t too large", {"time_ns": 1 << 62}, Drop.OUT_OF_RANGE),
    ("dev negative", {"device_us": -1}, Drop.OUT_OF_RANGE),
    ("rx zero", {"received_ns": 0}, Drop.OUT_OF_RANGE),
    ("unc negative", {"uncertainty_ns": -1}, Drop.OUT_OF_RANGE),
    ("unc too large", {"uncertainty_ns": 1 << 63}, Drop.OUT_OF_RANGE),
    ("no samples", {"offsets": b""}, Drop.WRONG_SHAPE),
    ("dt torn", {"offsets": b"\x00" * 11}, Drop.WRONG_SHAPE),
    ("too many", {"offsets": struct.pack("<257I", *range(257))}, Drop.WRONG_SHAPE),
    ("dt does not begin with 0", {"offsets": struct.pack("<3I", 1, 2, 3)}, Drop.TIME_BACKWARDS),
    ("dt goes back", {"offsets": struct.pack("<3I", 0, 5, 4)}, Drop.TIME_BACKWARDS),
    ("dt stands still", {"offsets": struct.pack("<3I", 0, 5, 5)}, Drop.TIME_BACKWARDS),
    ("dt spans too much", {"offsets": struct.pack("<3I", 0, 5, MAX_SPAN_NS + 1)}, Drop.TIME_BACKWARDS),
    ("ddt short", {"device_offsets": b"\x00" * 8}, Drop.WRONG_SHAPE),
    ("acc short", {"acc": floats(*[0.0] * 8)}, Drop.WRONG_SHAPE),
    ("acc torn", {"acc": b"\x00" * 35}, Drop.WRONG_SHAPE),
    ("gyr long", {"gyr": floats(*[0.0] * 12)}, Drop.WRONG_SHAPE),
    ("acc without gyr", {"gyr": None}, Drop.WRONG_SHAPE),
    ("gyr without acc", {"acc": None}, Drop.WRONG_SHAPE),
    ("neither", {"acc": None, "gyr": None, "mag": None}, Drop.WRONG_SHAPE),
    ("mag alone", {"acc": None, "gyr": None, "quat": floats(*[1.0, 0, 0, 0] * 3)}, Drop.WRONG_SHAPE),
    ("mag of other length", {"mag": floats(0.0, 0.0, 0.0)}, Drop.WRONG_SHAPE),
    ("mi without mag", {"mag": None, "mag_index": struct.pack("<H", 0)}, Drop.WRONG_SHAPE),
    ("mi torn", {"mag": floats(0, 0, 0), "mag_index": b"\x00"}, Drop.WRONG_SHAPE),
    ("mi empty", {"mag": b"", "mag_index": b""}, Drop.WRONG_SHAPE),
    ("mi beyond", {"mag": floats(0, 0, 0), "mag_index": struct.pack("<H", 3)}, Drop.WRONG_SHAPE),
    ("mi twice", {"mag": floats(*[0] * 6), "mag_index": struct.pack("<2H", 1, 1)}, Drop.WRONG_SHAPE),
    ("mi back", {"mag": floats(*[0] * 6), "mag_index": struct.pack("<2H", 2, 1)}, Drop.WRONG_SHAPE),
    ("mi of other length", {"mag": floats(*[0] * 6), "mag_index": struct.pack("<H", 1)}, Drop.WRONG_SHAPE),
    ("quat short", {"quat": floats(1, 0, 0)}, Drop.WRONG_SHAPE),
    ("quat too long a length", {"quat": floats(*[1.0, 0, 0, 0] * 2, 1.06, 0, 0, 0)}, Drop.OUT_OF_RANGE),
    ("quat zero", {"quat": floats(*[1.0, 0, 0, 0] * 2, 0, 0, 0, 0)}, Drop.OUT_OF_RANGE),
    ("quat NaN", {"quat": floats(*[1.0, 0, 0, 0] * 2, NAN, 0, 0, 0)}, Drop.NOT_FINITE),
    ("quat infinite", {"quat": floats(*[1.0, 0, 0, 0] * 2, INF, 0, 0, 0)}, Drop.NOT_FINITE),
]
for _name, _limit in (("acc", MAX_ACC), ("gyr", MAX_GYR), ("mag", MAX_MAG)):
    for _value, _drop in (
        (NAN, Drop.NOT_FINITE),
        (INF, Drop.NOT_FINITE),
        (-INF, Drop.NOT_FINITE),
        (1.001 * _limit, Drop.OUT_OF_RANGE),
        (-1.001 * _limit, Drop.OUT_OF_RANGE),
        (3e38, Drop.OUT_OF_RANGE),
    ):
        FAULTS.append((f"{_name} {_value:g}", {_name: floats(*[0.0] * 8, _value)}, _drop))


@pytest.mark.parametrize(("changes", "drop"), [f[1:] for f in FAULTS], ids=[f[0] for f in FAULTS])
def test_each_fault_is_named(changes: dict[str, Any], drop: Drop) -> None:
    read_samples(batch())
    with pytest.raises(WireError) as error:
        read_samples(batch(**changes))
    assert error.value.drop is drop
    assert str(error.value).startswith("imu/1: ")


@pytest.mark.parametrize(("name", "limit"), [("acc", MAX_ACC), ("gyr", MAX_GYR), ("mag", MAX_MAG)])
def test_the_limit_itself_is_believed(name: str, limit: float) -> None:
    samples = read_samples(batch(**{name: floats(*[0.0] * 8, -limit)}))
    assert getattr(samples, name)[2, 2] == -limit


def test_a_coarse_quaternion_is_taken_and_normalised() -> None:
    samples = read_samples(batch(acc=None, gyr=None, mag=None, quat=floats(*[0.98, 0.0, 0.0, 0.0] * 3)))
    assert samples.acc is None
    assert samples.quat is not None
    np.testing.assert_allclose(samples.quat, [[1.0, 0.0, 0.0, 0.0]] * 3)


def test_times_that_offsets_cannot_hold_are_not_written() -> None:
    good: dict[str, Any] = {"sequence": 0, "received_ns": 1, "uncertainty_ns": 0, "device_us": [0, 1]}
    for times in ([5, 4], [5, 5 + MAX_SPAN_NS + 1]):
        with pytest.raises(ValueError, match="time_ns of one batch"):
            write_samples(**good, time_ns=times)
    with pytest.raises(ValueError, match="device_us of one batch"):
        write_samples(**{**good, "device_us": [5, 4]}, time_ns=[1, 2])


@given(st.binary(max_size=64), st.binary(max_size=64), st.binary(max_size=64), st.binary(max_size=8))
def test_any_blocks_give_samples_or_a_named_drop(
    offsets: bytes, acc: bytes, quat: bytes, index: bytes
) -> None:
    for changes in (
        {"offsets": offsets, "acc": acc, "gyr": acc, "mag": None},
        {"offsets": b"\x00" * 4, "device_offsets": b"\x00" * 4, "acc": acc, "gyr": acc, "mag": None},
        {"acc": None, "gyr": None, "mag": None, "quat": quat},
        {"mag": acc, "mag_index": index},
    ):
        try:
            samples = read_samples(batch(**changes))
        except WireError:
            continue
        for block in (samples.acc, samples.gyr, samples.mag, samples.quat):
            assert block is None or np.isfinite(block).all()


@given(st.lists(st.sampled_from([None, *(fault[1] for fault in FAULTS)]), max_size=12))
def test_many_at_once_are_read_as_one_by_one(faults: list[dict[str, Any] | None]) -> None:
    batches = [batch(**(changes or {}), late=bool(i % 2)) for i, changes in enumerate(faults)]
    results = read_many(batches)
    assert len(results) == len(batches)
    for one, result in zip(batches, results, strict=True):
        try:
            alone = read_samples(one)
        except WireError as error:
            assert isinstance(result, WireError)
            assert (result.drop, str(result)) == (error.drop, str(error))  # noqa: PT017
            continue
        assert not isinstance(result, WireError)
        assert result.late == one.late
        for name in ("acc", "gyr", "mag"):
            np.testing.assert_array_equal(getattr(result, name), getattr(alone, name))
