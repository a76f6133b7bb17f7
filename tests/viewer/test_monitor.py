"""The monitor on a real bus: it sees who was there before it, and what comes."""

import io
import json
import threading
from collections.abc import Callable, Iterator
from typing import Any

import pytest

from brachium_router import service as router
from brachium_router.config import RouterSettings
from brachium_viewer import monitor
from brachium_viewer.health import Network
from brachium_viewer.monitor import MonitorSettings
from brachium_wire import keys
from brachium_wire.bus import Bus
from brachium_wire.codec import encode
from brachium_wire.messages import Info, Status

ROOM = "gym"


@pytest.fixture
def bus(unused_port: Callable[[], int]) -> Iterator[Bus]:
    port = unused_port()
    stop = threading.Event()
    thread = threading.Thread(target=router.run, args=(RouterSettings(room=ROOM, port=port), stop))
    thread.start()
    with Bus.open(f"tcp/127.0.0.1:{port}") as bus:
        yield bus
    stop.set()
    thread.join(15.0)
    assert not thread.is_alive()


class Stopper(io.StringIO):
    """Ends the monitor as soon as it wrote what is waited for."""

    def __init__(self, stop: threading.Event, wanted: str) -> None:
        super().__init__()
        self._stop, self._wanted = stop, wanted

    def write(self, text: str) -> int:
        if self._wanted in text:
            self._stop.set()
        return super().write(text)


@pytest.mark.network
def test_it_shows_who_was_there_before_and_who_comes(bus: Bus) -> None:
    bus.retain(
        keys.info(ROOM, "p01", "hand_r"), encode(Info(node="n7", rate_hz=50.0, origin="emulated", host="h"))
    )
    stop = threading.Event()
    out = Stopper(stop, '"battery_v": 3.5')
    key = keys.status(ROOM, "p01", "hand_r")
    status = encode(
        Status(
            node="n7",
            time_ns=1,
            connected=True,
            received=9,
            lost=1,
            out_of_order=0,
            battery_v=3.5,
            battery_hours=0.3,
        )
    )

    def send() -> None:
        while not stop.wait(0.05):
            bus.put(key, status)

    sender = threading.Thread(target=send)
    sender.start()
    settings = MonitorSettings(endpoint=bus.endpoint, room=ROOM, json=True, seconds=20.0)
    health = monitor.run(settings, stop, out)
    stop.set()
    sender.join()
    (node,) = health.nodes
    assert (node.node, node.state, node.received, node.battery_v) == ("n7", "missing", 9, 3.5)
    lines = [json.loads(line) for line in out.getvalue().splitlines()]
    assert lines[-1]["headline"] == "0 of 1 nodes live"
    assert {(s["kind"], s["up"]) for s in lines[-1]["services"]} >= {("router", True), ("monitor", True)}


@pytest.mark.network
def test_a_pipe_gets_plain_blocks(bus: Bus) -> None:
    stop = threading.Event()
    out = Stopper(stop, "nodes live")
    monitor.run(MonitorSettings(endpoint=bus.endpoint, room=ROOM, seconds=20.0), stop, out)
    assert out.getvalue().startswith("0 of 0 nodes live\n")
    assert "\x1b" not in out.getvalue()


def test_what_a_node_sent_in_vain_stands_beside_it() -> None:
    network = Network()
    status = Status(
        node="n7", time_ns=1, connected=True, received=9, lost=0, out_of_order=0, drops={"malformed": 3}
    )
    network.feed(keys.status(ROOM, "p01", "hand_r"), encode(status), 1)
    assert "  p01/hand_r dropped 3 malformed\n" in monitor.block(network.report(2))


@pytest.mark.parametrize(("hours", "warned"), [(0.5, False), (1 / 3, True), (0.0, True), (None, False)])
def test_a_low_battery_is_named(hours: float | None, warned: bool) -> None:
    network = Network()
    status = Status(
        node="n7", time_ns=1, connected=True, received=9, lost=0, out_of_order=0, battery_hours=hours
    )
    network.feed(keys.status(ROOM, "p01", "hand_r"), encode(status), 1)
    said = monitor.block(network.report(2))
    assert ("LOW BATTERY: p01/hand_r" in said) is warned
    if hours == 1 / 3:
        assert "20 min left\n" in said


@pytest.mark.parametrize(
    ("told", "shown"),
    [
        ({"battery_level": 0.5, "battery_hours": 5.26, "battery_v": 3.75}, "50 % 5.3 h"),
        ({"battery_level": 0.5, "battery_v": 3.75}, "50 %"),
        ({"battery_hours": 5.26, "battery_v": 3.75}, "5.3 h"),
        ({"battery_v": 3.75}, "3.75 V"),
        ({}, "-"),
    ],
)
def test_the_charge_and_the_hours_left_stand_in_the_table(told: dict[str, Any], shown: str) -> None:
    network = Network()
    status = Status(node="n7", time_ns=1, connected=True, received=9, lost=0, out_of_order=0, **told)
    network.feed(keys.status(ROOM, "p01", "hand_r"), encode(status), 1)
    head, row = monitor.block(network.report(2)).splitlines()[2:4]
    end = head.index("bat") + len("bat")  # figures stand to the right
    assert row[:end].endswith(f" {shown}")
    (node,) = json.loads(monitor.to_json(network.report(2)))["nodes"]
    assert {name: node[name] for name in ("battery_level", "battery_hours", "battery_v")} == {
        "battery_level": None,
        "battery_hours": None,
        "battery_v": None,
    } | told
