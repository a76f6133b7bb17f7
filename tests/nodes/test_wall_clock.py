"""Wall clocks jump by an hour, both ways, while a node sends: its samples' times go on as if nothing were."""

import asyncio
import time

import numpy as np
import pytest

from brachium_nodes import node_frames as f
from brachium_nodes.gateway import token_sha256
from brachium_nodes.node_client import NodeClient
from brachium_nodes.roster import NodeEntry
from brachium_wire.samples import read_samples

pytestmark = pytest.mark.network

HOUR_NS = 3_600_000_000_000
EVERY_S = 0.05


def device_us() -> int:
    return time.monotonic_ns() // 1000


def batch(sequence: int) -> f.Batch:
    offsets = (np.arange(5) * 1000).astype("<u4").tobytes()
    now_us = device_us() - 5000
    return f.Batch(sequence=sequence, device_us=now_us, offsets=offsets, acc=bytes(60), gyr=bytes(60))


def test_an_hour_forwards_and_backwards_changes_no_sample_s_time(gateway, listener, monkeypatch) -> None:
    true_ns, jumped = time.time_ns, [0]
    entry = NodeEntry(id="n1", token_sha256=token_sha256("secret"), subject="p01", segment="forearm_r")
    url = gateway(entry).url
    monkeypatch.setattr("time.time_ns", lambda: true_ns() + jumped[0])
    monkeypatch.setattr("time.time", lambda: (true_ns() + jumped[0]) * 1e-9)

    async def work() -> None:
        hello = f.Hello(node="n1", boot=1, chip="MPU-9150", rate_hz=100.0)
        node = NodeClient(url, "secret", hello, device_us)
        await node.join()
        for number in range(60):
            jumped[0] = (0, HOUR_NS, -HOUR_NS)[number // 20]
            await node.send(batch(5 * number))
            await asyncio.sleep(EVERY_S)
        await node.leave(300)

    asyncio.run(work())
    listener.until(lambda: len(listener.of("imu")) == 60, "60 batches")
    batches = listener.of("imu")
    offset_ns = [b.time_ns - 1000 * b.device_us for b in batches]
    assert max(offset_ns) - min(offset_ns) <= 2 * max(b.uncertainty_ns for b in batches) + 1_000_000
    times = [t for b in batches for t in read_samples(b).time_ns]
    assert times == sorted(set(times))
    last = listener.until_gone(1)["p01", "forearm_r"]
    assert (last.received, last.lost, last.drops) == (300, 0, {})
