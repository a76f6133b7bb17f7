"""A server of the pages in a thread, beside a router; and a screen that talks to it."""

import asyncio
import json
import threading
from collections.abc import Awaitable, Callable, Iterator
from contextlib import AbstractContextManager, contextmanager

import aiohttp
import pytest
from msgspec.structs import replace

from brachium_viewer.web import server
from brachium_wire import keys
from brachium_wire.bus import Bus
from brachium_wire.codec import encode
from brachium_wire.messages import Calibration, Info, Quality

START_S = 60.0


class Serving:
    """A server in a thread: its address, its pairing codes, and its end."""

    def __init__(self, **settings: object) -> None:
        self.stop, self._ready = threading.Event(), threading.Event()
        self.codes: list[str] = []
        self.address, self.error = "", None
        self.settings = server.WebSettings(
            port=0, on_ready=self._opened, on_code=self.codes.append, **settings
        )
        self.thread = threading.Thread(target=self._run)
        self.thread.start()
        assert self._ready.wait(START_S)
        if self.error is not None:
            raise self.error

    def _opened(self, address: str) -> None:
        self.address = address.rstrip("/")
        self._ready.set()

    def _run(self) -> None:
        try:
            server.run(self.settings, self.stop)
        except Exception as error:
            self.error = error
        finally:
            self._ready.set()


@contextmanager
def _serving(**settings: object) -> Iterator[Serving]:
    one = Serving(**settings)
    try:
        yield one
    finally:
        one.stop.set()
        one.thread.join(15.0)
        assert not one.thread.is_alive()


@pytest.fixture
def serve_pages() -> Callable[..., AbstractContextManager[Serving]]:
    """The server as a context manager."""
    return _serving


class Screen:
    """One WebSocket: what it hears by kind, and what it asks."""

    def __init__(self, socket: aiohttp.ClientWebSocketResponse) -> None:
        self.socket = socket
        self.number = 0
        self.last: dict[str, dict] = {}

    async def until(self, found: Callable[[dict], bool], timeout_s: float = 60.0) -> dict:
        """Return the first message that fits; the last of each kind that was heard is looked at first."""
        for message in self.last.values():
            if found(message):
                return message
        try:
            async with asyncio.timeout(timeout_s):
                while True:
                    message = json.loads((await self.socket.receive()).data)
                    self.last[message["kind"]] = message
                    if found(message):
                        return message
        except TimeoutError:
            raise AssertionError(f"not within {timeout_s:g} s; heard last: {self.last}") from None

    async def ask(self, verb: str, **words: object) -> dict:
        self.number += 1
        await self.socket.send_json({"kind": "do", "id": self.number, "verb": verb, **words})
        return await self.until(lambda m: m["kind"] == "answer" and m["id"] == self.number)


@pytest.fixture
def watch() -> Callable[..., None]:
    """Run what a screen at an address does."""

    def run(address: str, does: Callable[[Screen], Awaitable[None]], **headers: str) -> None:
        async def screen() -> None:
            async with (
                aiohttp.ClientSession() as session,
                session.ws_connect(f"{address}/ws", headers={"Origin": address, **headers}) as socket,
            ):
                await does(Screen(socket))

        asyncio.run(screen())

    return run


@pytest.fixture
def wear(router_endpoint: str, arm_at) -> Callable[..., AbstractContextManager[str]]:
    """A router beside which an arm with such sensors swings, at 50 Hz, as a context manager; its endpoint.

    `assumed` is what each skeleton says of its angles' quality.
    """

    @contextmanager
    def worn(
        *segments: str,
        speed: float = 1.0,
        calibration: Calibration | None = None,
        assumed: dict[str, Quality] | None = None,
    ) -> Iterator[str]:
        stop = threading.Event()

        def publish() -> None:
            with Bus.open(router_endpoint) as bus:
                for segment in segments:
                    info = Info(node=segment, rate_hz=100.0, origin="emulated", host="h")
                    bus.retain(keys.info("lab", "p01", segment), encode(info))
                if calibration is not None:
                    bus.retain(keys.calibration("lab", "p01"), encode(calibration))
                number = 0
                while not stop.wait(0.02):
                    number += 1
                    skeleton = replace(arm_at(0.02 * speed * number), assumed=assumed or {})
                    bus.put(keys.skeleton("lab", "p01", "right"), encode(skeleton))

        thread = threading.Thread(target=publish)
        thread.start()
        try:
            yield router_endpoint
        finally:
            stop.set()
            thread.join(15.0)

    return worn


@pytest.fixture
def moving_arm(wear) -> Iterator[str]:
    """A router beside which an emulated right arm with one sensor swings; its endpoint."""
    with wear("forearm_r") as endpoint:
        yield endpoint
