"""What a screen does when another one hangs, when its server is killed, and for who has only a keyboard."""

import itertools
import socket

import pytest

from brachium_wire import keys
from brachium_wire.bus import Bus
from brachium_wire.codec import decode
from brachium_wire.messages import Health

pytestmark = [pytest.mark.network, pytest.mark.browser]

DESK = (1400, 900)
EVERY_DRESS = tuple(itertools.product(("en", "de"), ("light", "dark"), (100,)))
SKIPPED = 100
LINE_CUT = ("WebSocket connection to ", "Failed to load resource: net::ERR_")
"""So begins what a browser complains of while a server is gone; how it ends depends on the instant."""
FURTHEST = 80
"""Presses of the Tab key from one end of the page to the other."""


def test_with_a_keyboard_alone_through_a_guided_calibration_to_a_counted_set(screen, network):
    with screen(DESK, "keyboard") as one:
        page = one.page

        def go(identity: str) -> None:
            """Press Tab until something has the focus, and see that it shows it."""
            for _ in range(FURTHEST):
                page.keyboard.press("Tab")
                if page.evaluate("document.activeElement.id") == identity:
                    break
            else:
                raise AssertionError(f"no Tab leads to {identity}")
            assert page.evaluate("getComputedStyle(document.activeElement).boxShadow") != "none"

        one.open("/")
        go("calibrate-guided")
        with network.wearer(routine="calibration"):
            one.until(lambda: page.inner_text("#headline").startswith("3 "))
            page.keyboard.press("Enter")
            one.until(lambda: page.is_visible("#prompt"))
            one.until(lambda: "palm up" in page.inner_text("#prompt-words").lower())
            one.picture("guided")
            one.until(lambda: page.inner_text("#calibration-state").startswith("Calibrated"))
            one.until(lambda: page.is_hidden("#prompt"))
            one.inspect("calibrated", dresses=EVERY_DRESS)

            go("tab-prepare")
            page.keyboard.press("ArrowRight")
            assert page.get_attribute("#tab-exercise", "aria-selected") == "true"
            go("start")
            page.keyboard.press("Enter")
            one.until(lambda: page.evaluate("document.activeElement.id") == "stop")
            one.until(lambda: page.inner_text("#count-value").isdigit())
            page.keyboard.press("Enter")
            one.until(lambda: page.is_visible("#start"))


def test_a_hanging_screen_slows_no_other_and_a_killed_server_is_found_again(screen, network):
    with screen(DESK, "line") as one, Bus.open(network.endpoint) as bus:
        page, frames = one.page, []

        def heard(text: str | bytes) -> None:
            if str(text).startswith('{"kind":"frame"'):
                frames.append(1)

        page.on("websocket", lambda line: line.on("framereceived", heard))
        one.open("/")
        with network.wearer():
            one.until(lambda: page.inner_text("#headline").startswith("3 "))
            one.until(lambda: bool(frames))
            told, counted = bus.subscribe(keys.services(network.room)), {"frames_skipped": 0}

            def skipped() -> int:
                for key, payload in told.drain():
                    if keys.parse(key).detail.startswith("web/"):
                        counted.update(decode(payload, Health).counts)
                return counted["frames_skipped"]

            one.until(lambda: bool(skipped() or told.received))
            with hanging_screen(network.web):
                seen, before = len(frames), skipped()
                one.until(lambda: skipped() - before >= SKIPPED and len(frames) - seen >= SKIPPED / 2)

            page.evaluate("window.opened = 'before'")
            page.click("#tab-exercise")
            page.click("#start")
            one.until(lambda: page.is_visible("#stop"))
            network.kill_web()
            one.until(lambda: "No connection" in page.inner_text("#headline"))
            one.picture("cut")
            network.start_web()
            one.until(lambda: page.inner_text("#headline").startswith("3 "))
            one.until(lambda: "started anew" in page.inner_text("#action-said"))
            assert page.is_visible("#start")
            assert page.inner_text("#subject-name") == "p01"
            assert page.evaluate("window.opened") == "before", "it came back by itself, not anew"
            before = len(frames)
            one.until(lambda: len(frames) > before)
            one.picture("back")
        one.complaints = [said for said in one.complaints if not said.startswith(LINE_CUT)]


def hanging_screen(port: int) -> socket.socket:
    """A screen that has begun to watch and reads nothing."""
    line = socket.socket()
    line.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    line.connect(("127.0.0.1", port))
    host = f"127.0.0.1:{port}"
    line.sendall(
        f"GET /ws HTTP/1.1\r\nHost: {host}\r\nOrigin: http://{host}\r\nConnection: Upgrade\r\n"
        "Upgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
        "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n".encode()
    )
    return line
