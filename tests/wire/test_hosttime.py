"""Host time goes on with the monotonic clock, whatever the wall clock does, and can be asked for."""

import time
from collections.abc import Callable

import msgpack
import pytest

from brachium_wire import keys
from brachium_wire.bus import Bus
from brachium_wire.hosttime import HostClock, NoHostTime, follow_host_time, tell_host_time


def test_it_starts_as_the_wall_clock_and_never_goes_back() -> None:
    before = time.time_ns()
    clock = HostClock()
    readings = [clock.now_ns() for _ in range(1000)]
    assert readings == sorted(readings)
    assert abs(readings[0] - before) < 5_000_000_000


def test_jumps_of_the_wall_clock_change_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = HostClock()
    before = clock.now_ns()
    monkeypatch.setattr(time, "time_ns", lambda: 0)
    assert 0 <= clock.now_ns() - before < 5_000_000_000


def test_a_reading_of_the_monotonic_clock_has_its_host_time(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(time, "time_ns", lambda: 1_000_000)
    monkeypatch.setattr(time, "monotonic_ns", lambda: 400)
    clock = HostClock()
    monkeypatch.setattr(time, "monotonic_ns", lambda: 900)
    assert clock.now_ns() == 1_000_500
    assert clock.at(400) == 1_000_000
    assert HostClock(start_ns=7).at(3) == 10


@pytest.mark.network
def test_another_process_follows_within_the_uncertainty_it_states(
    connect: Callable[[], Bus], until: Callable[[Callable[[], object], str], None]
) -> None:
    teller, asker = connect(), connect()
    far = HostClock(start_ns=123_456_789_000_000_000)
    tell_host_time(teller, "gym", "g1", far.now_ns)
    until(lambda: asker.ask(keys.host_time("gym", "g1")), "an answer")
    clock = follow_host_time(asker, "gym", "g1")
    moment = time.monotonic_ns()
    assert abs(clock.at(moment) - far.at(moment)) <= clock.uncertainty_ns < 2_000_000_000
    assert clock.uncertainty_ns > 0


@pytest.mark.network
@pytest.mark.parametrize(
    "answer",
    [b"", b"\xc1", b"x" * 1000, msgpack.packb({"t": "now"}), msgpack.packb({"t": -1}), msgpack.packb([1])],
)
def test_a_foolish_answer_is_no_time(
    connect: Callable[[], Bus], until: Callable[[Callable[[], object], str], None], answer: bytes
) -> None:
    teller, asker = connect(), connect()
    teller.serve(keys.host_time("gym", "g1"), lambda _key, _question: answer)
    until(lambda: asker.ask(keys.host_time("gym", "g1")) == answer, "the answer itself")
    with pytest.raises(NoHostTime, match="is that gateway running"):
        follow_host_time(asker, "gym", "g1")


@pytest.mark.network
def test_nobody_to_ask_is_said(connect: Callable[[], Bus]) -> None:
    with pytest.raises(NoHostTime, match="'g1' in room 'gym'"):
        follow_host_time(connect(), "gym", "g1", timeout_s=0.2)
