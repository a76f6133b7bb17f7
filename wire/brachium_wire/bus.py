"""The session on the bus: the only module that knows Zenoh.

Sensor streams are published DROP and not express: a slow reader loses samples, it never slows a sensor; and
batches of the transport stay batches. Zenoh's callbacks only append to a bounded deque (`Inbox`), so a slow
program loses its own oldest messages, counts them, and holds nobody up.
"""

import json
import logging
import threading
import time
from collections import deque
from collections.abc import Callable
from types import TracebackType
from typing import Any, Self

import zenoh

from brachium_wire import keys
from brachium_wire.topics import TOPICS, Urgency

log = logging.getLogger(__name__)

DEFAULT_ENDPOINT = "tcp/127.0.0.1:7447"
LEASE_MS = 4000
"""A host that vanished is noticed after this; TCP hides shorter Wi-Fi outages."""

_PRIORITY = {
    Urgency.DATA: zenoh.Priority.DATA,
    Urgency.CONTROL: zenoh.Priority.INTERACTIVE_HIGH,
    Urgency.BACKGROUND: zenoh.Priority.BACKGROUND,
}


class NoRouter(RuntimeError):
    """No router answered at the endpoint."""


def client_config(endpoint: str) -> zenoh.Config:
    """Return the configuration of every process but the router: a client that listens nowhere."""
    settings: dict[str, Any] = {
        "mode": "client",
        # One attempt; the loop in Bus.open retries, because Zenoh's own wait ignores Ctrl-C.
        "connect": {
            "endpoints": [endpoint],
            "timeout_ms": 1000,
            "exit_on_failure": True,
            "retry": {"period_init_ms": 100, "period_max_ms": 1000, "period_increase_factor": 1.5},
        },
        "listen": {"endpoints": []},
        "scouting": {"multicast": {"enabled": False}, "gossip": {"enabled": False}},
        "transport": {"link": {"tx": {"lease": LEASE_MS}}, "shared_memory": {"enabled": False}},
    }
    return zenoh.Config.from_json5(json.dumps(settings))


class Inbox:
    """What a subscription received and nobody read yet; the oldest is dropped, and counted, when it is full."""

    def __init__(self, capacity: int) -> None:
        self._queue: deque[tuple[str, bytes]] = deque(maxlen=capacity)
        self._arrived = threading.Event()
        self._wake: Callable[[], None] | None = None
        self.received = 0
        self.dropped = 0

    def drain(self) -> list[tuple[str, bytes]]:
        """Return all (key, payload) received since the last call, in order of arrival."""
        self._arrived.clear()
        out = []
        while self._queue:
            out.append(self._queue.popleft())
        return out

    def wait(self, timeout_s: float) -> bool:
        """Return True as soon as something is there, False after `timeout_s`."""
        return self._arrived.wait(timeout_s)

    def on_arrival(self, wake: Callable[[], None]) -> None:
        """Call `wake` from Zenoh's thread at each arrival after a drain; it must not block."""
        self._wake = wake

    def put(self, key: str, payload: bytes) -> None:
        """Append one message."""
        self.received += 1
        if len(self._queue) == self._queue.maxlen:
            self.dropped += 1
        self._queue.append((key, payload))
        if not self._arrived.is_set():
            self._arrived.set()
            if self._wake is not None:
                self._wake()


class Bus:
    """A client of the room's router. Use it in a `with` block: a session left open keeps the process alive."""

    def __init__(self, session: zenoh.Session, endpoint: str) -> None:
        self._session = session
        self.endpoint = endpoint
        self._publishers: dict[str, zenoh.Publisher] = {}
        self._kept: list[Any] = []
        self._retained: dict[str, bytes] = {}

    @classmethod
    def open(
        cls,
        endpoint: str = DEFAULT_ENDPOINT,
        *,
        stop: threading.Event | None = None,
        timeout_s: float | None = 10.0,
    ) -> Self:
        """Connect to the router, trying again until `timeout_s` (None: for ever) or until `stop` is set.

        Raises NoRouter with one line that says what to do.
        """
        stop = stop or threading.Event()
        deadline = None if timeout_s is None else time.monotonic() + timeout_s
        warned = False
        while not stop.is_set():
            try:
                return cls(zenoh.open(client_config(endpoint)), endpoint)
            except zenoh.ZError as error:
                reason = str(error).split(" at /")[0]
            if deadline is not None and time.monotonic() >= deadline:
                raise NoRouter(f"no router at {endpoint} ({reason}); start one with: brachium router") from None
            if not warned:
                log.warning("waiting for the router at %s", endpoint)
                warned = True
            stop.wait(0.2)
        raise NoRouter(f"stopped while waiting for the router at {endpoint}")

    def connected(self) -> bool:
        """Return whether the router is reached now."""
        return bool(self._session.info.routers_zid())

    def put(self, key: str, payload: bytes) -> None:
        """Publish on a key of the topic table with that topic's QoS. Never blocks, never raises for a lost router."""
        publisher = self._publishers.get(key)
        if publisher is None:
            row = TOPICS[keys.parse(key).topic]
            publisher = self._session.declare_publisher(
                key,
                priority=_PRIORITY[row.urgency],
                congestion_control=zenoh.CongestionControl.DROP,
                express=False,
            )
            self._publishers[key] = publisher
        publisher.put(payload)

    def retain(self, key: str, payload: bytes) -> None:
        """Publish on a key and answer who asks for it later with the last value, as long as this bus is open."""
        known = key in self._retained
        self._retained[key] = payload
        if not known:

            def answer(query: zenoh.Query) -> None:
                query.reply(key, self._retained[key])

            self._kept.append(self._session.declare_queryable(key, answer))
        self.put(key, payload)

    def fetch(self, key_expression: str, timeout_s: float = 1.0) -> list[tuple[str, bytes]]:
        """Return the retained (key, payload) that match; empty when there is none."""
        replies = self._session.get(key_expression, timeout=timeout_s, target=zenoh.QueryTarget.ALL)
        return [(str(r.ok.key_expr), r.ok.payload.to_bytes()) for r in replies if r.ok is not None]

    def subscribe(self, key_expression: str, capacity: int = 16384) -> Inbox:
        """Return the inbox of everything put on matching keys from now on."""
        inbox = Inbox(capacity)

        def heard(sample: zenoh.Sample) -> None:
            if sample.kind == zenoh.SampleKind.PUT:
                inbox.put(str(sample.key_expr), sample.payload.to_bytes())

        self._kept.append(self._session.declare_subscriber(key_expression, heard))
        return inbox

    def serve(self, key_expression: str, answer: Callable[[str, bytes], bytes]) -> None:
        """Answer queries on matching keys: `answer(key, question)` runs on Zenoh's thread and returns the bytes."""

        def asked(query: zenoh.Query) -> None:
            question = query.payload
            key = str(query.key_expr)
            query.reply(key, answer(key, question.to_bytes() if question is not None else b""))

        self._kept.append(self._session.declare_queryable(key_expression, asked))

    def ask(self, key: str, question: bytes = b"", timeout_s: float = 2.0) -> bytes | None:
        """Return the first answer to a query, or None when nobody answers in time."""
        for reply in self._session.get(key, payload=question, timeout=timeout_s):
            if reply.ok is not None:
                return reply.ok.payload.to_bytes()
        return None

    def announce(self, key: str) -> Callable[[], None]:
        """Hold a liveliness token on `key` until the returned function is called or the bus is closed."""
        token = self._session.liveliness().declare_token(key)
        self._kept.append(token)

        def end() -> None:
            if token in self._kept:
                self._kept.remove(token)
                token.undeclare()

        return end

    def alive(self, key_expression: str, timeout_s: float = 1.0) -> list[str]:
        """Return the keys of the liveliness tokens that match now."""
        replies = self._session.liveliness().get(key_expression, timeout=timeout_s)
        return [str(r.ok.key_expr) for r in replies if r.ok is not None]

    def watch_alive(self, key_expression: str, changed: Callable[[str, bool], None]) -> None:
        """Call `changed(key, alive)` on Zenoh's thread for each matching token, those there now included."""

        def heard(sample: zenoh.Sample) -> None:
            changed(str(sample.key_expr), sample.kind == zenoh.SampleKind.PUT)

        self._kept.append(self._session.liveliness().declare_subscriber(key_expression, heard, history=True))

    def close(self) -> None:
        """Leave the bus. Closing twice is harmless."""
        try:
            self._session.close()
        except zenoh.ZError as error:
            log.debug("closing the session: %s", error)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()
