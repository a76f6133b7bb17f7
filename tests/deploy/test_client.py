"""`import brachium`, against a real router."""

import asyncio
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

import brachium
from brachium.checks import free_port
from brachium_wire import keys
from brachium_wire.bus import Bus
from brachium_wire.codec import encode
from brachium_wire.messages import Event, Health, Message, SegmentPose, Skeleton
from brachium_wire.samples import write_samples

pytestmark = pytest.mark.network

EXAMPLE = Path(__file__).parents[2] / "docs" / "examples" / "monitor.py"
T0 = 1_700_000_000_000_000_000


def skeleton(number: int) -> Skeleton:
    return Skeleton(
        time_ns=T0 + number * 20_000_000,
        side="right",
        origin="emulated",
        forward="none",
        trunk_from_world=(1.0, 0.0, 0.0, 0.0),
        segments={"forearm_r": SegmentPose(quality="good", sequence=number)},
        positions={"elbow": (0.2, 0.0, -0.3)},
        angles={"elbow_flexion": 0.5},
    )


def batch(number: int) -> Message:
    return write_samples(
        sequence=5 * number,
        time_ns=T0 + 10_000_000 * np.arange(5),
        device_us=10_000 * np.arange(5),
        received_ns=T0,
        uncertainty_ns=1000,
        acc=np.tile([0.0, 0.0, 9.81], (5, 1)),
        gyr=np.zeros((5, 3)),
    )


@contextmanager
def repeating(endpoint: str, key: str, make) -> Iterator[None]:
    """Publish one message after the other until the block ends: a subscription takes a moment to be there."""
    done = threading.Event()

    def publish() -> None:
        with Bus.open(endpoint) as bus:
            number = 0
            while not done.wait(0.01):
                made = make(number)
                bus.put(key, made if isinstance(made, bytes) else encode(made))
                number += 1

    thread = threading.Thread(target=publish)
    thread.start()
    try:
        yield
    finally:
        done.set()
        thread.join()


CASES = {
    "skeletons": (brachium.skeletons, keys.skeleton("lab", "p01", "right"), skeleton, "right"),
    "samples": (brachium.samples, keys.imu("lab", "p01", "forearm_r"), batch, "forearm_r"),
    "health": (
        brachium.health,
        keys.service("lab", "gateway", "g1"),
        lambda n: Health(kind="gateway", id="g1", time_ns=n + 1, uptime_s=1.0),
        "gateway/g1",
    ),
    "events": (brachium.events, keys.event("lab", "p01"), lambda n: Event(time_ns=n + 1, kind="note"), ""),
}


@pytest.mark.parametrize("case", CASES)
def test_a_plain_loop_reads_each_stream_in_order(case: str, router_endpoint: str):
    read, key, make, detail = CASES[case]
    with repeating(router_endpoint, key, make):
        got = []
        for heard_key, message in read(room="lab", endpoint=router_endpoint):
            if heard_key.detail != detail:
                continue  # the router's own health
            assert heard_key.room == "lab"
            got.append(message)
            if len(got) == 20:
                break
    numbers = [getattr(m, "sequence", getattr(m, "time_ns", None)) for m in got]
    assert numbers == sorted(set(numbers))
    assert len(numbers) == 20


@pytest.mark.parametrize("case", CASES)
def test_an_asynchronous_loop_reads_the_same(case: str, router_endpoint: str):
    read, key, make, detail = CASES[case]

    async def take() -> list[object]:
        got: list[object] = []
        async for heard_key, message in read(room="lab", endpoint=router_endpoint):
            if heard_key.detail == detail:
                got.append(message)
            if len(got) == 20:
                break
        return got

    with repeating(router_endpoint, key, make):
        got = asyncio.run(asyncio.wait_for(take(), 30.0))
    assert len(got) == 20


def test_samples_are_arrays_in_si(router_endpoint: str):
    with repeating(router_endpoint, keys.imu("lab", "p01", "hand_r"), batch):
        key, samples = next(iter(brachium.samples(segment="hand_r", endpoint=router_endpoint)))
    assert (key.subject, key.detail, len(samples)) == ("p01", "hand_r", 5)
    assert samples.acc is not None
    np.testing.assert_allclose(samples.acc, np.tile([0.0, 0.0, 9.81], (5, 1)), atol=1e-6)


def test_another_subject_is_not_heard(router_endpoint: str):
    mine, other = (keys.skeleton("lab", who, "right") for who in ("p01", "p02"))
    with repeating(router_endpoint, mine, skeleton), repeating(router_endpoint, other, skeleton):
        stream = iter(brachium.skeletons(subject="p02", endpoint=router_endpoint))
        assert {next(stream)[0].subject for _ in range(20)} == {"p02"}


def test_what_breaks_the_contract_is_dropped_and_counted_and_nothing_else_is_lost(router_endpoint: str):
    key = keys.skeleton("lab", "p01", "right")

    def good_and_bad(number: int) -> Skeleton | bytes:
        return skeleton(number) if number % 2 else b"\xc1"

    stream = brachium.skeletons(endpoint=router_endpoint)
    with repeating(router_endpoint, key, good_and_bad):
        reader = iter(stream)
        times = [next(reader)[1].time_ns for _ in range(20)]
    assert set(np.diff(times)) == {40_000_000}
    assert stream.drops["malformed"] >= 19


def test_no_router_is_one_line(monkeypatch: pytest.MonkeyPatch):
    opened = Bus.open.__func__
    monkeypatch.setattr(Bus, "open", classmethod(lambda cls, where: opened(cls, where, timeout_s=0.0)))
    with pytest.raises(brachium.NoRouter, match="no router at"):
        next(iter(brachium.skeletons(endpoint="tcp/127.0.0.1:9")))


@pytest.mark.parametrize("names", [{"subject": "p/1"}, {"room": "*"}, {"subject": "service"}])
def test_evil_names_are_refused_before_anything_is_opened(names: dict[str, str]):
    with pytest.raises(ValueError, match="cannot be used"):
        brachium.skeletons(**names)


def test_a_program_that_fails_in_its_loop_still_ends(router_endpoint: str):
    """Without care Zenoh's threads keep such a process alive for ever."""
    loop = f"for key, s in brachium.skeletons(endpoint={router_endpoint!r}):\n    raise OSError('mine')"
    command = [sys.executable, "-c", f"import brachium\n{loop}"]
    with repeating(router_endpoint, keys.skeleton("lab", "p01", "right"), skeleton):
        done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 1
    assert "OSError: mine" in done.stderr


def test_the_example_prints_elbows_and_ends_with_ctrl_c(router_endpoint: str):
    command = [sys.executable, str(EXAMPLE), "lab", router_endpoint]
    with repeating(router_endpoint, keys.skeleton("lab", "p01", "right"), skeleton):
        example = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        assert example.stdout is not None
        lines = [example.stdout.readline() for _ in range(5)]
        example.send_signal(signal.SIGINT)
        example.communicate(timeout=60)
    assert lines == ["p01 right elbow   28.6 deg\n"] * 5


def test_all_promised_names_are_there():
    for name in brachium.__all__:
        assert getattr(brachium, name) is not None
    with pytest.raises(AttributeError, match="no attribute 'skeleton'"):
        brachium.skeleton  # noqa: B018 - the lookup is the test


def test_ctrl_c_while_no_router_answers_shows_nothing_of_the_transport():
    code = (
        "import sys, brachium, logging\nlogging.basicConfig(level=logging.WARNING)\n"
        f"for _ in brachium.skeletons(endpoint='tcp/127.0.0.1:{free_port()}'): pass"
    )
    process = subprocess.Popen([sys.executable, "-c", code], stderr=subprocess.PIPE, text=True)
    assert process.stderr is not None
    assert "waiting for the router" in process.stderr.readline()
    process.send_signal(signal.SIGINT)
    said = process.communicate(timeout=60)[1]
    assert "KeyboardInterrupt" in said
    assert "ZError" not in said
