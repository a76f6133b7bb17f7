"""The gateway's event loop: nobody waits where it is quiet; what comes close together is read together."""

import asyncio
import selectors
import socket
from collections.abc import Callable, Iterator

import pytest

from brachium_nodes import paced_loop
from brachium_nodes.paced_loop import REST_S, PacedSelector

Pair = tuple[socket.socket, socket.socket]


class Clock:
    """Time that passes in sleep alone, during which something may happen."""

    def __init__(self) -> None:
        self.now_s = 1000.0
        self.slept: list[float] = []
        self.meanwhile: Callable[[], object] = lambda: None

    def monotonic(self) -> float:
        return self.now_s

    def sleep(self, seconds: float) -> None:
        self.slept.append(seconds)
        self.now_s += seconds
        self.meanwhile()


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    made = Clock()
    monkeypatch.setattr(paced_loop, "time", made)
    return made


@pytest.fixture
def pairs() -> Iterator[list[Pair]]:
    made = [socket.socketpair() for _ in range(3)]
    yield made
    for here, there in made:
        here.close()
        there.close()


@pytest.fixture
def selector(pairs: list[Pair]) -> Iterator[PacedSelector]:
    with PacedSelector() as made:
        for here, _ in pairs:
            made.register(here, selectors.EVENT_READ)
        yield made


def look(selector: PacedSelector, timeout: float | None) -> set[socket.socket]:
    """Return the sockets that were found, each read empty."""
    found: set[socket.socket] = set()
    for key, _ in selector.select(timeout):
        assert isinstance(key.fileobj, socket.socket)
        key.fileobj.recv(100)
        found.add(key.fileobj)
    return found


def test_the_first_after_a_quiet_time_is_heard_at_once(selector, pairs, clock) -> None:
    for here, there in pairs:
        there.send(b"x")
        assert look(selector, 1.0) == {here}
        clock.now_s += REST_S
    assert clock.slept == []


def test_what_comes_during_the_rest_is_read_together(selector, pairs, clock) -> None:
    (a, to_a), (b, to_b), (c, to_c) = pairs
    to_a.send(b"x")
    assert look(selector, None) == {a}
    to_b.send(b"x")
    clock.meanwhile = lambda: to_c.send(b"x")
    assert look(selector, None) == {b, c}
    assert clock.slept == [pytest.approx(REST_S)]


def test_work_that_waits_is_not_held_up(selector, pairs, clock) -> None:
    (a, to_a), (b, to_b), _ = pairs
    to_a.send(b"x")
    assert look(selector, 1.0) == {a}
    to_b.send(b"x")
    assert look(selector, 0.0) == {b}
    assert clock.slept == []


def test_a_rest_ends_when_something_else_is_due(selector, pairs, clock) -> None:
    (a, to_a), _, _ = pairs
    to_a.send(b"x")
    assert look(selector, 1.0) == {a}
    assert look(selector, REST_S / 4) == set()
    assert clock.slept == [REST_S / 4]


def test_the_loop_serves_many_and_loses_nothing() -> None:
    counts: list[int] = []

    async def serve(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        writer.write(await reader.readexactly(100))
        await writer.drain()
        writer.close()

    async def ask(port: int) -> None:
        reader, writer = await asyncio.open_connection("127.0.0.1", port)
        for _ in range(10):
            writer.write(b"0123456789")
            await asyncio.sleep(0)
        counts.append(len(await reader.read()))
        writer.close()

    async def meet() -> None:
        server = await asyncio.start_server(serve, "127.0.0.1", 0)
        await asyncio.gather(*(ask(server.sockets[0].getsockname()[1]) for _ in range(20)))
        server.close()
        await server.wait_closed()

    with asyncio.Runner(loop_factory=paced_loop.paced_loop) as runner:
        runner.run(meet())
    assert counts == [100] * 20
