"""The whole view in this process: bus, viewer process, page; only the browser is missing."""

import http.client
import os
import signal
import socket
import threading
import time
from collections.abc import Callable
from pathlib import Path

import pytest

pytest.importorskip("rerun", reason="needs the extra 'view'")
psutil = pytest.importorskip("psutil")  # comes with rerun-sdk

from brachium_viewer.live import ViewSettings, newest, run  # noqa: E402  after the check for the extra
from brachium_viewer.viewer_process import ViewerProcess, ViewError, free_port  # noqa: E402
from brachium_wire import keys  # noqa: E402
from brachium_wire.bus import Bus, Inbox  # noqa: E402
from brachium_wire.codec import decode, encode  # noqa: E402
from brachium_wire.messages import Health  # noqa: E402

pytestmark = pytest.mark.network
DEADLINE_S = 60.0


def viewer_pid() -> int:
    pids = [p.pid for p in psutil.Process().children(recursive=True) if "rerun" in p.name()]
    assert len(pids) == 1
    return pids[0]


def watch(inbox: Inbox, send: Callable[[int], None], until: Callable[[Health], bool]) -> Health:
    """Send skeletons at 50 Hz until the view's health satisfies `until`."""
    deadline, n = time.monotonic() + DEADLINE_S, 0
    while time.monotonic() < deadline:
        send(n)
        n += 1
        inbox.wait(0.02)
        for _, payload in inbox.drain():
            health = decode(payload, Health)
            if health.kind == "view" and until(health):
                return health
    raise AssertionError(f"the view's health never came to {until}")


def test_a_view_takes_skeletons_tells_its_address_and_listens_on_loopback(router_endpoint, arm_at, open_view):
    with Bus.open(router_endpoint) as bus, open_view(router_endpoint) as running:
        inbox = bus.subscribe(keys.services("lab", "view/*"))

        def send(n: int) -> None:
            bus.put(keys.skeleton("lab", "p01", "right"), encode(arm_at(n * 0.02)))
            bus.put(keys.skeleton("lab", "p01", "left"), b"\xc1 this is no skeleton")

        health = watch(inbox, send, lambda h: h.counts.get("delivered", 0) > 20 and bool(h.drops))
        assert health.text == running.address
        assert health.drops.keys() == {"malformed"}
        assert health.counts["overflow"] == 0
        port = int(running.address.rstrip("/").rpartition(":")[2])
        page = http.client.HTTPConnection("127.0.0.1", port, timeout=60)
        page.request("GET", "/re_viewer_bg.wasm")
        assert page.getresponse().read(4) == b"\0asm"
        page.close()
        listening = [
            c.laddr.ip
            for p in (psutil.Process(), psutil.Process(viewer_pid()))
            for c in p.net_connections(kind="inet")
            if c.status == psutil.CONN_LISTEN
        ]
        ours = [ip for ip in listening if ip != "127.0.0.1"]
        assert len(listening) >= 3
        assert ours == []
    assert running.error is None


def test_a_frozen_viewer_holds_nobody_up_and_fills_no_memory(router_endpoint, arm_at, open_view):
    with Bus.open(router_endpoint) as bus, open_view(router_endpoint) as running:
        inbox = bus.subscribe(keys.services("lab", "view/*"))

        def send(n: int) -> None:
            bus.put(keys.skeleton("lab", "p01", "right"), encode(arm_at(n * 0.02)))

        watch(inbox, send, lambda h: h.counts.get("delivered", 0) > 20)
        os.kill(viewer_pid(), signal.SIGSTOP)
        # The loop goes on reading the bus while the newest drawings replace the older ones.
        marks: list[Health] = []

        def stands(now: Health) -> bool:
            """Whether 500 drawings were replaced since anything was last delivered."""
            if not marks or now.counts["delivered"] != marks[0].counts["delivered"]:
                marks[:] = [now]
            return now.counts["replaced"] > marks[0].counts["replaced"] + 500

        later, frozen = watch(inbox, send, stands), marks[0]
        assert later.counts["received"] > frozen.counts["received"]
        assert later.counts["overflow"] == 0
    assert running.error is None  # and it ended, its viewer still frozen


def test_the_end_of_the_viewer_is_the_end_of_the_view_and_says_why(router_endpoint, open_view):
    with open_view(router_endpoint) as running:
        os.kill(viewer_pid(), signal.SIGKILL)
        running.thread.join(15.0)
        assert not running.thread.is_alive()
    assert isinstance(running.error, ViewError)
    assert "ended with code -9" in str(running.error)


@pytest.mark.parametrize(
    ("port", "what"), [("web_port", "the web page"), ("grpc_port", "the viewer's stream")]
)
def test_a_taken_port_is_named_and_leaves_no_viewer_behind(router_endpoint, port, what):
    with socket.socket() as holder:
        holder.bind(("127.0.0.1", 0))
        holder.listen()
        taken = holder.getsockname()[1]
        ports = {"web_port": 0, "grpc_port": 0} | {port: taken}
        settings = ViewSettings(endpoint=router_endpoint, web=True, **ports)
        with pytest.raises(ViewError, match=f"port {taken}, wanted for {what}"):
            run(settings, threading.Event())
    assert not [p for p in psutil.Process().children(recursive=True) if "rerun" in p.name()]


def test_a_viewer_that_does_not_start_says_its_last_words():
    port = free_port(0, "test")
    with (
        ViewerProcess(grpc_port=port, memory_limit="much") as viewer,
        pytest.raises(ViewError, match="ended with"),
    ):
        viewer.wait_ready(threading.Event())


def test_only_the_newest_of_each_key_is_shown():
    assert newest([("a", b"1"), ("b", b"2"), ("a", b"3")]) == [("a", b"3"), ("b", b"2")]
    samples = keys.imu("lab", "p01", "hand_r")
    assert newest([(samples, b"1"), ("a", b"1"), (samples, b"2"), (f"{samples}/status", b"3")]) == [
        ("a", b"1"),
        (f"{samples}/status", b"3"),
        (samples, b"1"),
        (samples, b"2"),
    ]


def test_statistics_are_off_in_a_configuration_of_our_own():
    with ViewerProcess(
        grpc_port=free_port(0, "test"), memory_limit="64MB", web_files_port=free_port(0, "test")
    ) as viewer:
        viewer.wait_ready(threading.Event())
        folder = Path(psutil.Process(viewer.pid).environ()["XDG_CONFIG_HOME"])
        written = (folder / "rerun" / "analytics.json").read_text(encoding="utf-8")
        assert '"analytics_enabled":false' in written
    assert not folder.exists()
