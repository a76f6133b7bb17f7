"""The server over real sockets: a router, the bus, and screens that speak as browsers do."""

import threading

import pytest

from brachium_wire import keys
from brachium_wire.bus import Bus
from brachium_wire.codec import encode

pytestmark = pytest.mark.network


@pytest.fixture
def moving_arm(router_endpoint: str, arm_at):
    """An arm that is published at 50 Hz."""
    stop = threading.Event()

    def publish() -> None:
        with Bus.open(router_endpoint) as bus:
            number = 0
            while not stop.wait(0.02):
                number += 1
                bus.put(keys.skeleton("lab", "p01", "right"), encode(arm_at(0.02 * number)))

    thread = threading.Thread(target=publish)
    thread.start()
    yield router_endpoint
    stop.set()
    thread.join(5.0)


def test_a_screen_sees_the_arm_and_what_is_known(serve_pages, watch, moving_arm, tmp_path):
    async def look(screen):
        hello = await screen.until(lambda m: m["kind"] == "hello")
        assert hello["reference"]["elbow_flexion"] == [0.0, 150.0]
        frame = await screen.until(lambda m: m["kind"] == "frame")
        assert frame["arms"]["right"]["angles"]["elbow_flexion"][1] == "good"
        state = await screen.until(lambda m: m["kind"] == "state" and m["sides"] == ["right"])
        assert state["origin"] == "emulated"

    with serve_pages(endpoint=moving_arm, sessions=tmp_path, open_door=True) as serving:
        watch(serving.address, look)
