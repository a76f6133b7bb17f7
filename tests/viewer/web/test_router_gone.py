"""A router gone during a set: nothing is said to be kept that is not, and a stop stops all the same."""

import threading

import pytest

from brachium_router.config import RouterSettings, endpoint
from brachium_router.service import run as run_router
from brachium_viewer.sessions.store import Store

pytestmark = pytest.mark.network

EXERCISE = {"exercise": "elbow-flexion", "side": "right"}


class Router:
    """A router that ends and begins again at one port."""

    def __init__(self, port: int) -> None:
        self.settings = RouterSettings(port=port)
        self.begin()

    def begin(self) -> None:
        self.stop = threading.Event()
        self.thread = threading.Thread(target=run_router, args=(self.settings, self.stop))
        self.thread.start()

    def end(self) -> None:
        self.stop.set()
        self.thread.join(15.0)
        assert not self.thread.is_alive()


@pytest.fixture
def router(unused_port):
    one = Router(unused_port())
    yield one
    one.end()


@pytest.fixture
def router_endpoint(router):
    return endpoint(router.settings)


@pytest.fixture
def how_sets_ended(moving_arm, serve_pages, watch, tmp_path):
    """What the store says of a session that a screen does, and ends with its report."""

    def found(does) -> list[str]:
        async def session(screen):
            await screen.until(lambda m: m["kind"] == "state" and m["sides"] == ["right"])
            await does(screen)
            done = await screen.ask("report")
            assert done["ok"], done

        with serve_pages(endpoint=moving_arm, sessions=tmp_path, open_door=True) as serving:
            watch(serving.address, session)
        with Store.open(tmp_path) as store:
            (kept,) = store.sessions("p01")
            return [one.ended for one in kept.sets]

    return found


def test_nothing_is_answered_as_kept_while_the_router_is_gone(router, how_sets_ended):
    async def session(screen):
        def recording_is(how):
            return lambda m: m["kind"] == "state" and m["recording"]["state"] == how

        assert (await screen.ask("exercise", **EXERCISE))["ok"]
        await screen.until(recording_is("on"))
        router.end()
        state = await screen.until(recording_is("cut"))
        assert [alarm["what"] for alarm in state["alarms"]] == ["router"]
        asked = [
            await screen.ask("mark"),
            await screen.ask("pain", value=7, when="after"),
            await screen.ask("effort", value=3, when="after"),
            await screen.ask("donning"),
        ]
        assert [(one["ok"], "nothing is recorded" in one["reason"]) for one in asked] == [(False, True)] * 4
        stopped = await screen.ask("patient-stop", reason="pain")
        assert not stopped["ok"]
        assert "not written" in stopped["reason"]
        state = await screen.until(lambda m: m["kind"] == "state" and m["stopped"] == "pain")
        assert state["set"] is None
        again = await screen.ask("exercise", **EXERCISE)
        assert "nothing is recorded" in again["reason"]
        screen.last.clear()
        router.begin()
        assert (await screen.until(recording_is("on")))["alarms"] == []
        while not (await screen.ask("patient-stop", reason="pain"))["ok"]:
            pass  # the recorder comes back by itself, maybe a little later than the pages

    assert how_sets_ended(session) == ["patient-stop"]


def test_a_stop_without_a_router_ends_the_set_and_is_written_when_it_is_back(router, how_sets_ended):
    async def session(screen):
        assert (await screen.ask("exercise", repetitions=1, **EXERCISE))["ok"]
        await screen.until(lambda m: m["kind"] == "frame" and m["set"] and m["set"]["done"])
        router.end()
        await screen.until(lambda m: m["kind"] == "state" and m["recording"]["state"] == "cut")
        assert "not written yet" in (await screen.ask("stop"))["reason"]
        assert (await screen.ask("stop"))["reason"] == "no set is running"
        router.begin()
        while not (await screen.ask("mark"))["ok"]:
            pass  # the recorder comes back by itself

    assert how_sets_ended(session) == ["done"]  # without its end it would be "stopped"
