"""The emulated device against the reading side: each is written from the protocol alone."""

import numpy as np
import pytest

from brachium_nodes.shimmer.dialogue import Dialogue, Wish
from brachium_nodes.shimmer.emulated import EmulatedShimmer
from brachium_nodes.shimmer.samples import Stream
from brachium_nodes.shimmer.ticks import microseconds

MS = 1_000_000


def measured(number):
    t = number / 51.2
    return (
        np.array([1.0 + np.sin(t), -2.0, 9.0]),
        np.array([0.5, -1.5 * np.cos(t), 0.25]),
        np.array([20.0, 5.0, -40.0 + np.sin(t)]),
    )


def connected(device, wish=None, chunk=7):
    """Set a device up; return the dialogue."""
    now = 10**18
    dialogue = Dialogue(wish or Wish(), now)
    to_device = dialogue.begin()
    for _ in range(2000):
        came = device.receive(to_device)
        to_device = b""
        for i in range(0, len(came), chunk):
            to_device += dialogue.receive(came[i : i + chunk], now)
        now += 50 * MS
        to_device += dialogue.tick(now)
        if dialogue.device is not None:
            return dialogue
    raise AssertionError("never set up")


@pytest.mark.parametrize("accelerometer", ["wide-range", "low-noise"])
def test_what_the_device_measures_comes_out_in_si(accelerometer):
    device = EmulatedShimmer(measured, seed=3)
    found = connected(device, Wish(accelerometer=accelerometer)).device
    assert device.streaming
    assert found.rate_hz == 51.2
    assert found.firmware == "LogAndStream 0.16.4"
    assert found.converted.warnings == ()
    stream = Stream(found)
    batches = []
    for number in range(100):
        data = device.packet(number, 12345 + 640 * number)
        batches += stream.feed(data, 10**18 + number * 19_531_250)
    frames = [frame for frame, _ in batches]
    assert [f.sequence for f in frames] == list(range(99))  # the last is not sure yet
    assert [f.device_us for f in frames] == [microseconds(12345 + 640 * n) for n in range(99)]
    acc, gyr, mag = (
        np.concatenate([np.frombuffer(getattr(f, name), "<f4").reshape(-1, 3) for f in frames])
        for name in ("acc", "gyr", "mag")
    )
    left = found.converted.calibration
    truth = [np.array(part) for part in zip(*(measured(n) for n in range(99)), strict=True)]
    step = 1.0 / (410 if accelerometer == "wide-range" else 90)
    assert np.abs(acc - left.accel_bias - truth[0]).max() < step
    assert np.abs(gyr - left.gyro_bias - truth[1]).max() < np.radians(1.0 / 16.0)
    field = (mag - left.mag_offset) @ np.array(left.mag_matrix).T
    size = np.linalg.norm(field, axis=1) / np.linalg.norm(truth[2], axis=1)
    assert size == pytest.approx(size.mean(), rel=0.01)
    assert size.mean() == pytest.approx(1.0, abs=0.03)  # known from the data sheet alone
    assert np.abs(field / size[:, None] - truth[2]).max() < 0.5
