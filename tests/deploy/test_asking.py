"""What a service tells while it is asked is shown, to the last word before its answer."""

import threading
from types import SimpleNamespace
from typing import Any, cast

import pytest

from brachium import asking
from brachium_wire.bus import Bus, Inbox
from brachium_wire.codec import encode
from brachium_wire.messages import Answer, Calibration


class AtOnce:
    """A thread whose work is done when it has begun: as where the one that waits was held up."""

    def __init__(self, target: Any, **_: object) -> None:
        self.start = target


def test_what_was_told_right_before_the_answer_is_shown(monkeypatch: pytest.MonkeyPatch) -> None:
    news = Inbox(16)

    def ask(*_: object, **__: object) -> bytes:
        news.put("k", encode(Calibration(time_ns=1, state="running")))
        return encode(Answer(ok=True))

    monkeypatch.setattr(asking.threading, "Thread", AtOnce)
    shown: list[Calibration] = []
    bus = cast(Bus, SimpleNamespace(ask=ask))
    answer = asking.asked(bus, "k", {}, news, shown.append, threading.Event(), 1.0)
    assert answer == Answer(ok=True)
    assert [one.state for one in shown] == ["running"]
