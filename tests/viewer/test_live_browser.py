"""The live view in a real browser, judged by its picture and by what the browser asked for.

BRACHIUM_KEEP_PICTURE names where the picture is kept; nowhere if unset.
"""

import io
import os
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import numpy as np
import pytest

from brachium_wire import keys
from brachium_wire.bus import Bus
from brachium_wire.codec import encode
from brachium_wire.messages import Calibration, Status

pytestmark = [pytest.mark.browser, pytest.mark.network]

KEEP = os.environ.get("BRACHIUM_KEEP_PICTURE")
SIZE = (1400, 900)
SEEN_S = 180.0
"""A browser without a graphics card needs its time."""
COUNT_REFUSED = """
    window.refused = [];
    document.addEventListener("securitypolicyviolation", (event) => window.refused.push(event.blockedURI));
"""


@contextmanager
def moving(endpoint: str, arm_at: Any) -> Iterator[None]:
    """A wearer who moves until the block ends; a browser without a graphics card keeps up with 10 Hz."""
    stop = threading.Event()

    def feed() -> None:
        with Bus.open(endpoint) as bus:
            done = Calibration(time_ns=1, state="done", pose="neutral", progress=1.0, forward="facing")
            bus.retain(keys.calibration("lab", "p01"), encode(done))
            start_s, n = time.monotonic(), 0
            while not stop.wait(max(0.0, start_s + 0.1 * n - time.monotonic())):
                now_s, now_ns = time.monotonic() - start_s, time.time_ns()
                quality = "held" if now_s % 9.0 > 7.5 else "good"
                off = 5.0 * np.sin(0.8 * now_s)
                shown = arm_at(now_s, quality=quality, time_ns=now_ns, off=off)
                bus.put(keys.skeleton("lab", "p01", "right"), encode(shown))
                bus.put(keys.truth("lab", "p01", "right"), encode(arm_at(now_s, time_ns=now_ns)))
                for segment in shown.segments if n % 10 == 0 else ():
                    counts = {"received": 10 * n, "lost": n // 40, "out_of_order": 0}
                    radio = {"rate_hz": 100.0, "battery_v": 3.9, "rssi_dbm": -54.0}
                    status = Status(node=segment, time_ns=now_ns, connected=True, **counts, **radio)
                    bus.put(keys.status("lab", "p01", segment), encode(status))
                n += 1

    thread = threading.Thread(target=feed)
    thread.start()
    try:
        yield
    finally:
        stop.set()
        thread.join(15.0)


@dataclass
class Seen:
    """Where the arm's parts are in a picture: pixels of each colour, and the hand's middle."""

    counts: dict[str, int]
    hand: tuple[float, float]


def look(png: bytes) -> Seen:
    """Find the arm in the 3-D panel: orange upper arm, blue forearm, green hand, in any light."""
    import PIL.Image

    rgb = np.asarray(PIL.Image.open(io.BytesIO(png)).convert("RGB"), dtype=np.float64)
    height, width = rgb.shape[:2]
    panel = rgb[int(0.1 * height) : int(0.6 * height), : int(0.47 * width)]
    red, green, blue = np.moveaxis(panel, -1, 0)
    bright = panel.max(axis=-1) > 60.0
    masks = {
        "upper arm": bright & (red > 1.25 * green) & (green > 2.0 * blue),
        "forearm": bright & (blue > 1.15 * green) & (green > 1.5 * red),
        "hand": bright & (green > 1.25 * blue) & (blue > 2.0 * red),
    }
    rows, columns = np.nonzero(masks["hand"])
    middle = (float(columns.mean()), float(rows.mean())) if len(rows) else (0.0, 0.0)
    return Seen({name: int(mask.sum()) for name, mask in masks.items()}, middle)


def wait_for(page: Any, seen: Callable[[Seen], bool], what: str) -> tuple[Seen, bytes]:
    """Take pictures until one satisfies `seen`."""
    from playwright.sync_api import Error

    deadline = time.monotonic() + SEEN_S
    found, png = Seen({}, (0.0, 0.0)), b""
    while time.monotonic() < deadline:
        try:
            png = page.screenshot(timeout=60_000)
        except Error:  # a page that is still loading its 43 MB may have no picture yet
            page.wait_for_timeout(1000)
            continue
        found = look(png)
        if seen(found):
            return found, png
        page.wait_for_timeout(1000)
    failed = Path(tempfile.gettempdir()) / "live-view-failed.png"
    failed.write_bytes(png)
    raise AssertionError(f"{what} within {SEEN_S:g} s; seen: {found}; last picture: {failed}")


def hosts(urls: list[str]) -> set[str | None]:
    """Return the machines that the addresses name; data and blob name none."""
    return {urlsplit(url).hostname for url in urls if not url.startswith(("data:", "blob:"))}


def test_the_arm_is_seen_and_moves_and_the_browser_talks_to_nobody_else(
    browser, router_endpoint, arm_at, open_view
):
    with (
        open_view(router_endpoint, rate_hz=10.0) as running,
        moving(router_endpoint, arm_at),
    ):
        page = browser.new_page(viewport={"width": SIZE[0], "height": SIZE[1]})
        page.add_init_script(COUNT_REFUSED)
        requests: list[str] = []
        answered: list[str] = []
        page.on("request", lambda request: requests.append(request.url))
        page.on("response", lambda response: answered.append(response.url))
        page.goto(running.address + "?renderer=webgl", wait_until="commit")

        first, _ = wait_for(page, lambda seen: min(seen.counts.values()) > 400, "no arm was seen")
        moved, png = wait_for(
            page,
            lambda seen: (
                np.hypot(seen.hand[0] - first.hand[0], seen.hand[1] - first.hand[1]) > 15.0
                and min(seen.counts.values()) > 400
            ),
            "the arm did not move",
        )
        refused = page.evaluate("window.refused")
        if KEEP:
            page.wait_for_timeout(60_000)  # so that the plots have something to show
            _, png = wait_for(page, lambda seen: min(seen.counts.values()) > 400, "no arm was seen")
            Path(KEEP).parent.mkdir(parents=True, exist_ok=True)
            Path(KEEP).write_bytes(png)
        page.close()

    assert moved.hand != first.hand
    assert hosts(requests) == {"127.0.0.1"}
    assert hosts(answered) == {"127.0.0.1"}
    # Rerun did try, and the policy did refuse: without it the line above would prove nothing.
    assert hosts(refused) & {"tel.rerun.io", "api.github.com"}
    assert running.error is None
