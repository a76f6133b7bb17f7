"""Frames go out as skeletons come, thirty in a second, and a full room wakes the server no more often."""

import asyncio

import pytest

from brachium_viewer.web.pace import Bell, Pace
from brachium_wire.bus import Inbox


def gone(rate_hz: float, seconds: float, late_s: float = 0.0) -> list[float]:
    """The instants of frames when skeletons come at `rate_hz` and each frame goes with the first it may."""
    pace, instants = Pace(30.0), []
    for number in range(round(rate_hz * seconds)):
        now_s = 100.0 + number / rate_hz + (late_s if number % 3 == 0 else 0.0)
        if pace.pause_s(now_s) == 0.0:
            pace.gone(now_s)
            instants.append(now_s)
    return instants


@pytest.mark.parametrize("late_s", [0.0, 0.004])
@pytest.mark.parametrize("rate_hz", [50.0, 60.0, 100.0])
def test_thirty_frames_a_second_of_skeletons_that_come_faster(rate_hz: float, late_s: float):
    assert len(gone(rate_hz, 10.0, late_s)) == pytest.approx(300, abs=3)


@pytest.mark.parametrize("rate_hz", [5.0, 20.0, 25.0])
def test_every_skeleton_of_a_slower_source_goes_out(rate_hz: float):
    assert len(gone(rate_hz, 10.0)) == round(10.0 * rate_hz)


def test_a_pause_of_the_source_is_not_made_up_for():
    pace = Pace(30.0)
    pace.gone(100.0)
    pace.gone(200.0)
    assert pace.pause_s(200.0) == 0.0
    pace.gone(200.0)
    assert pace.pause_s(200.0) == pytest.approx(1 / 30)


def test_the_bell_rings_once_for_whatever_comes_and_only_while_it_is_armed():
    async def listen() -> tuple[list[bool], int]:
        inbox, woken = Inbox(100), []
        loop = asyncio.get_running_loop()
        call = loop.call_soon_threadsafe
        loop.call_soon_threadsafe = lambda *words: (woken.append(1), call(*words))[1]
        bell = Bell(inbox)
        inbox.put("before", b"")
        bell.arm()
        inbox.drain()
        rings = [await bell.rings(0.01)]
        inbox.put("not armed any more", b"")
        bell.arm()
        inbox.drain()
        for number in range(50):
            inbox.put(f"arm {number}", b"")
        rings.append(await bell.rings(10.0))
        return rings, len(woken)

    assert asyncio.run(listen()) == ([False, True], 1)


def test_what_comes_after_the_loop_has_ended_harms_nobody():
    async def listen() -> Inbox:
        inbox = Inbox(10)
        Bell(inbox).arm()
        return inbox

    inbox = asyncio.run(listen())
    inbox.put("late", b"")
    assert inbox.received == 1
