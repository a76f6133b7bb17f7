"""What the streams know of a host's time, from answers that come, come late or do not come."""

import time
from types import SimpleNamespace
from typing import Any, cast

import pytest

from brachium_viewer.lsl import service
from brachium_wire import keys
from brachium_wire.bus import Bus
from brachium_wire.hosttime import HostClock, NoHostTime
from brachium_wire.messages import Info

HOUR_NS = 3_600_000_000_000
KEY = keys.parse(keys.info("gym", "p01", "hand_r"))
INFO = Info(node="n", rate_hz=100.0, origin="worn", host="gw")


def test_a_host_that_began_anew_and_answers_late_is_asked_again(monkeypatch: pytest.MonkeyPatch) -> None:
    answers: list[HostClock | None] = []

    def follow(*_: Any, **__: Any) -> HostClock:
        answer = answers.pop(0)
        if answer is None:
            raise NoHostTime("nobody answers")
        return answer

    monkeypatch.setattr(service, "follow_host_time", follow)
    monkeypatch.setattr(service, "LOOK_S", -1.0)  # the next try is due at once
    bus = SimpleNamespace(announce=lambda _key: None)
    pylsl = SimpleNamespace(local_clock=time.monotonic)
    one = service.Service(cast(Bus, bus), service.LslSettings(room="gym"), cast(Any, pylsl))

    def told_h() -> int:
        """Return the hour of the host that LSL's zero is in."""
        clock = one._clock("p01")
        assert clock is not None
        return round(clock.host(0.0) / HOUR_NS)

    one._inform(KEY, INFO)
    answers[:] = [HostClock(2 * HOUR_NS)]
    assert told_h() == 2
    assert told_h() == 2  # and nobody is asked
    one._inform(KEY, INFO)
    answers[:] = [None, HostClock(5 * HOUR_NS)]
    assert told_h() == 2  # what is known stays until the host answers
    assert told_h() == 5
    assert told_h() == 5
