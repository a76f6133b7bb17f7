"""What the therapist's page costs and how late it draws, beside a page that draws an empty canvas.

A skeleton is published with the moment of its publication as its time; a picture counts as drawn when the
browser begins the next one. Both pages hang on the same server, one after the other, in the same run; each is
opened once and watched for several windows.
"""

import threading
import time
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

import numpy as np

from brachium.bench_gateway import start_router
from brachium.bench_run import WINDOWS, cpu_seconds, pid
from brachium.browser import chromium
from brachium.checks import free_port
from brachium.processes import Child, Processes
from brachium.shell import Failed
from brachium.skeleton_source import ROOM, SkeletonSource
from brachium_viewer.statistics import percentiles
from brachium_wire import keys
from brachium_wire.bus import Bus

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

READY_S = 60.0
SETTLE_S = 4.0
"""A page's first second compiles what draws it."""

# Notes how long ago a frame was published when its picture was done. Every picture begins with clear.
LISTENER = """
window.__late = [];
let newest = null;
const Plain = window.WebSocket;
window.WebSocket = class extends Plain {
  constructor(...words) {
    super(...words);
    this.addEventListener("message", (event) => {
      const message = JSON.parse(event.data);
      if (message.kind === "frame") newest = message.arms.right.t;
    });
  }
};
const clear = WebGL2RenderingContext.prototype.clear;
WebGL2RenderingContext.prototype.clear = function (...words) {
  if (newest !== null) {
    const t = newest;
    newest = null;
    requestAnimationFrame(() => window.__late.push(Date.now() - t));
  }
  return clear.apply(this, words);
};
"""
EMPTY = """() => {
const canvas = document.createElement("canvas");
[canvas.width, canvas.height] = [900, 500];
document.body.replaceChildren(canvas);
const gl = canvas.getContext("webgl2");
let due = false;
const socket = new WebSocket(`ws://${location.host}/ws`);
socket.onmessage = (event) => {
  if (due || JSON.parse(event.data).kind !== "frame") return;
  due = true;
  requestAnimationFrame(() => { due = false; gl.clearColor(0, 0, 0, 0); gl.clear(gl.COLOR_BUFFER_BIT); });
};
}"""


@dataclass(frozen=True, kw_only=True)
class PageFigures:
    """Delays from a skeleton's publication to its picture, ms, and CPU over wall time; medians of windows."""

    page_p50_ms: float
    page_p99_ms: float
    page_hz: float
    empty_p50_ms: float
    """The same of a page that draws an empty canvas."""
    empty_p99_ms: float
    empty_hz: float
    server_cpu: float
    """The server with one screen, of a core."""
    server_cpu_windows: list[float]
    server_alone_cpu: float
    """The server with no screen."""
    renderer: str


@dataclass(frozen=True)
class _Window:
    p50_ms: float
    p99_ms: float
    hz: float
    cpu: float


def measure(window_s: float) -> PageFigures:
    """Measure both pages, window by window in turn. Raises Failed without playwright or Chromium."""
    with TemporaryDirectory() as made, Processes() as processes:
        folder = Path(made)
        endpoint = start_router(processes, folder)
        with Bus.open(endpoint) as bus, SkeletonSource(bus), chromium() as browser:
            server, address = start_pages(processes, folder, endpoint, bus)
            alone = [_cpu(server, window_s) for _ in range(WINDOWS)]
            page = _watched(browser, server, f"{address}/", window_s)
            empty = _watched(browser, server, f"{address}/door", window_s, empty=True)
            renderer = _renderer(browser, address)
    return PageFigures(
        page_p50_ms=median(w.p50_ms for w in page),
        page_p99_ms=median(w.p99_ms for w in page),
        page_hz=median(w.hz for w in page),
        empty_p50_ms=median(w.p50_ms for w in empty),
        empty_p99_ms=median(w.p99_ms for w in empty),
        empty_hz=median(w.hz for w in empty),
        server_cpu=median(w.cpu for w in page),
        server_cpu_windows=[w.cpu for w in page],
        server_alone_cpu=median(alone),
        renderer=renderer,
    )


def start_pages(processes: Processes, folder: Path, endpoint: str, bus: Bus) -> tuple[Child, str]:
    """Start the server of the pages, with its door open; return it and its address."""
    port = free_port()
    words = ["web", "--room", ROOM, "--endpoint", endpoint, "--port", str(port), "--no-password"]
    words += ["--sessions", str(folder / "sessions")]
    server = processes.start("web", words, stdout=folder / "web.out", stderr=folder / "web.err")
    deadline = time.monotonic() + READY_S
    while not bus.alive(keys.services(ROOM, "web/*/alive")) or "pages:" not in _said(folder):
        if not server.alive() or time.monotonic() > deadline:
            raise Failed(f"the pages were not served: {server.complaint()}")
        threading.Event().wait(0.1)
    return server, f"http://127.0.0.1:{port}"


def _said(folder: Path) -> str:
    return (folder / "web.out").read_text("utf-8") if (folder / "web.out").exists() else ""


def _watched(
    browser: "Browser", server: Child, address: str, window_s: float, *, empty: bool = False
) -> list[_Window]:
    """Open a page, let it settle; return by window how late it drew and what the server used meanwhile."""
    page = browser.new_page(viewport={"width": 1400, "height": 900})
    try:
        page.add_init_script(LISTENER)
        page.goto(address)
        if empty:
            page.evaluate(EMPTY)
        _begun(page, address)
        page.wait_for_timeout(SETTLE_S * 1e3)
        return [_window(page, server, address, window_s) for _ in range(WINDOWS)]
    finally:
        page.close()


def _window(page: "Page", server: Child, address: str, window_s: float) -> _Window:
    page.evaluate("window.__late.length = 0")
    cpu = _cpu(server, window_s, page)
    late = page.evaluate("window.__late")
    if not late:
        raise Failed(f"{address}: nothing was drawn")
    p50, p99 = percentiles(list(map(float, late)))
    return _Window(p50 or np.nan, p99 or np.nan, len(late) / window_s, cpu)


def _begun(page: "Page", address: str) -> None:
    """Return once pictures come; asked again and again, because the page lets nobody wait inside it."""
    deadline = time.monotonic() + READY_S
    while page.evaluate("window.__late.length") < 10:
        if time.monotonic() > deadline:
            raise Failed(f"{address}: no picture within {READY_S:.0f} s")
        page.wait_for_timeout(100)


def _cpu(server: Child, window_s: float, page: "Page | None" = None) -> float:
    number = pid(server)
    begun, before = time.monotonic(), cpu_seconds(number)
    if page is None:
        time.sleep(window_s)
    else:
        page.wait_for_timeout(window_s * 1e3)
    return (cpu_seconds(number) - before) / (time.monotonic() - begun)


def _renderer(browser: "Browser", address: str) -> str:
    page = browser.new_page()
    page.goto(f"{address}/")
    told = page.evaluate(
        "() => { const gl = document.createElement('canvas').getContext('webgl2');"
        " const known = gl.getExtension('WEBGL_debug_renderer_info');"
        " return known ? gl.getParameter(known.UNMASKED_RENDERER_WEBGL) : 'unknown'; }"
    )
    page.close()
    return str(told)
