"""The session on the bus: the only module that knows Zenoh.

Sensor streams are published DROP and not express: a slow reader loses samples, it never slows a sensor; and
batches of the transport stay batches. Zenoh's callbacks only append to a bounded deque (`Inbox`), so a slow
program loses its own oldest messages, counts them, and holds nobody up.
"""

import json
import logging
import os
import re
import threading
import time
from collections import deque
from collections.abc import Callable
from types import TracebackType
from typing import Any, Self

import zenoh

from brachium_wire import keys
from brachium_wire.codec import encode
from brachium_wire.heard_keys import HeardKeys
from brachium_wire.messages import Answer
from brachium_wire.topics import TOPICS, Urgency

log = logging.getLogger(__name__)

DEFAULT_ENDPOINT = "tcp/127.0.0.1:7447"
LEASE_MS = 4000
"""A host that vanished is noticed after this; TCP hides shorter Wi-Fi outages."""
ANSWERED_S = 10.0
"""A late answer must not count as none; that all have answered ends the wait, and so does a dead line."""
ROOM_USER = "room"
"""The user all programs of a room attach as, where the room has a password."""
PASSWORD_VARIABLE = "BRACHIUM_PASSWORD"
"""Environment variable with the room's password: a command line would show it to every user."""

_PRIORITY = {
    Urgency.DATA: zenoh.Priority.DATA,
    Urgency.CONTROL: zenoh.Priority.INTERACTIVE_HIGH,
    Urgency.BACKGROUND: zenoh.Priority.BACKGROUND,
}
_ENDPOINT = re.compile(r"(tcp|tls|quic|udp|ws)/[^\s/?#]+:[0-9]{1,5}([?#]\S*)?|unixsock-stream/\S+")


class NoRouter(RuntimeError):
    """No router answered at the endpoint."""


class BadEndpoint(NoRouter, ValueError):
    """Nothing can be an endpoint that is written so."""


def client_config(endpoint: str, password: str | None = None) -> zenoh.Config:
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
        "transport": {
            "link": {"tx": {"lease": LEASE_MS, "queue": {"size": {"data": 16}}}},
            "shared_memory": {"enabled": False},
        },
    }
    if password:
        settings["transport"]["auth"] = {"usrpwd": {"user": ROOM_USER, "password": password}}
    return zenoh.Config.from_json5(json.dumps(settings))


class Inbox:
    """What a subscription received and nobody read yet; the oldest is dropped, and counted, when it is full.

    `received` counts all arrivals, `dropped` those of them that nobody will read.
    """

    def __init__(self, capacity: int) -> None:
        self._queue: deque[tuple[str, bytes]] = deque(maxlen=capacity)
        # Held for an append or a copy: the counts are exact, no arrival is missed.
        self._lock = threading.Lock()
        self._arrived = threading.Event()
        self._wake: Callable[[], None] | None = None
        self.received = 0
        self.dropped = 0

    def drain(self) -> list[tuple[str, bytes]]:
        """Return all (key, payload) received since the last call, in order of arrival."""
        with self._lock:
            out = list(self._queue)
            self._queue.clear()
            self._arrived.clear()
        return out

    def wait(self, timeout_s: float) -> bool:
        """Return True as soon as something is there, False after `timeout_s`."""
        return self._arrived.wait(timeout_s)

    def on_arrival(self, wake: Callable[[], None]) -> None:
        """Call `wake` from Zenoh's thread at the first arrival after each drain; it must not block.

        It is called at once if something is there already.
        """
        with self._lock:
            self._wake = wake
            waiting = bool(self._queue)
        if waiting:
            wake()

    def put(self, key: str, payload: bytes) -> None:
        """Append one message."""
        with self._lock:
            self.received += 1
            self.dropped += len(self._queue) == self._queue.maxlen
            self._queue.append((key, payload))
            if self._arrived.is_set():
                return
            self._arrived.set()
            wake = self._wake
        if wake is not None:
            wake()


class Bus:
    """A client of the room's router. Use it in a `with` block: a session left open keeps the process alive.

    Any thread may call it. Callbacks run on Zenoh's threads, one each; one that blocks holds up every
    subscription of this bus. Keys and key expressions that are not ours raise keys.BadKey before Zenoh sees
    them: a key beyond 64 kB would break its session for good.
    """

    def __init__(self, session: zenoh.Session, endpoint: str) -> None:
        self._session = session
        self._heard_keys = HeardKeys(self._declare_key)
        self.endpoint = endpoint
        self._lock = threading.Lock()
        self._declaring = threading.Lock()
        self._retaining = threading.Lock()
        self._closed = False
        self._publishers: dict[str, zenoh.Publisher] = {}
        self._kept: list[Any] = []
        self._retained: dict[str, bytes] = {}
        self._answering: dict[str, zenoh.Queryable[Any]] = {}

    @classmethod
    def open(
        cls,
        endpoint: str = DEFAULT_ENDPOINT,
        *,
        stop: threading.Event | None = None,
        timeout_s: float | None = 10.0,
        password: str | None = None,
    ) -> Self:
        """Connect to the router, trying again until `timeout_s` (None: for ever) or until `stop` is set.

        A room with a password is given it as `password`, or by the environment (PASSWORD_VARIABLE).
        Raises NoRouter with one line that says what to do; BadEndpoint, one of them, at once.
        """
        password = password or os.environ.get(PASSWORD_VARIABLE)
        if not _ENDPOINT.fullmatch(endpoint):
            raise BadEndpoint(f"endpoint {endpoint[:80]!r} cannot be used: write it as tcp/<host>:<port>")
        stop = stop or threading.Event()
        deadline = None if timeout_s is None else time.monotonic() + timeout_s
        warned = False
        while not stop.is_set():
            try:
                return cls(zenoh.open(client_config(endpoint, password)), endpoint)
            except zenoh.ZError as error:
                reason = str(error).split(" at /")[0]
            if deadline is not None and time.monotonic() >= deadline:
                raise NoRouter(f"no router at {endpoint} ({reason}); {_to_do(password)}") from None
            if not warned:
                log.warning("waiting for the router at %s", endpoint)
                warned = True
            stop.wait(0.2)
        raise NoRouter(f"stopped while waiting for the router at {endpoint}")

    def connected(self) -> bool:
        """Return whether the router is reached now."""
        return bool(self._session.info.routers_zid())

    def put(self, key: str, payload: bytes) -> None:
        """Publish on a key of the topic table with that topic's QoS.

        Never blocks; never raises for a lost router or a closed bus: what nobody can receive is lost.
        """
        try:
            (self._publishers.get(key) or self._publisher(key)).put(payload)
        except zenoh.ZError as error:
            if not self._closed:
                raise
            log.debug("put after close on %s: %s", key, error)

    def _publisher(self, key: str) -> zenoh.Publisher:
        row = TOPICS.get(keys.parse(key).topic)
        if row is None:
            raise keys.BadKey(f"nothing is put on {key!r}: it is a token or a query")
        # One at a time: of two publishers that a session declares for one key at once, one loses what is
        # put on it. Declaring waits for nobody, so a callback that waits here does not hold up the session.
        with self._declaring:
            publisher = self._publishers.get(key)
            if publisher is None:
                publisher = self._publishers[key] = self._session.declare_publisher(
                    key,
                    priority=_PRIORITY[row.urgency],
                    congestion_control=zenoh.CongestionControl.DROP,
                    express=False,
                )
        return publisher

    def retain(self, key: str, payload: bytes) -> None:
        """Publish on a key and answer who asks for it later with the last value, as long as this bus is open.

        Who subscribes, then fetches, and reads that before what it received, ends with the last value.
        """
        keys.parse(key)
        with self._retaining:  # the order of what is kept is the order of what is put
            self._retained[key] = payload  # before the put: who comes between the two must find the value
            if key not in self._answering and not self._closed:
                self._answering[key] = self._session.declare_queryable(key, self._teller(key))
            self.put(key, payload)

    def forget(self, key: str) -> None:
        """Answer for a retained key no more; who heard its value keeps it. Nothing happens where none is."""
        keys.parse(key)
        with self._retaining:
            answering = self._answering.pop(key, None)
            self._retained.pop(key, None)
            if answering is not None and not self._closed:
                answering.undeclare()  # type: ignore[no-untyped-call]  # as Zenoh types it

    def _teller(self, key: str) -> Callable[[zenoh.Query], None]:
        def tell(query: zenoh.Query) -> None:
            payload = self._retained.get(key)
            if payload is not None:  # else it was forgotten just now
                query.reply(key, payload)

        return tell

    def _keep(self, declared: Any) -> None:
        with self._lock:
            self._kept.append(declared)  # Zenoh undeclares what nobody holds

    def fetch(self, key_expression: str, timeout_s: float = ANSWERED_S) -> list[tuple[str, bytes]]:
        """Return the retained (key, payload) that match; empty when there is none."""
        wanted = keys.expression(key_expression)
        replies = self._session.get(wanted, timeout=timeout_s, target=zenoh.QueryTarget.ALL)
        return [(str(r.ok.key_expr), r.ok.payload.to_bytes()) for r in replies if r.ok is not None]

    def subscribe(self, key_expression: str, capacity: int = 16384) -> Inbox:
        """Return the inbox of everything put on matching keys from now on."""
        inbox = Inbox(capacity)

        def heard(sample: zenoh.Sample) -> None:
            if sample.kind == zenoh.SampleKind.PUT:
                key = str(sample.key_expr)
                self._heard_keys.see(key)
                inbox.put(key, sample.payload.to_bytes())

        self._keep(self._session.declare_subscriber(keys.expression(key_expression), heard))
        return inbox

    def _declare_key(self, key: str) -> object:
        try:
            return self._session.declare_keyexpr(key)
        except zenoh.ZError:  # closed meanwhile
            return None

    def serve(self, key_expression: str, answer: Callable[[str, bytes], bytes]) -> None:
        """Answer queries on matching keys with the bytes of `answer(key, question)`, run on Zenoh's thread.

        `key` is always one plain key: a query on a wildcard, which may only look for retained values, is
        refused here. When `answer` raises, the error is logged and the asker gets an Answer that says so.
        """
        self.serve_later(key_expression, lambda key, question, reply: reply(answer(key, question)))

    def serve_later(
        self, key_expression: str, asked: Callable[[str, bytes, Callable[[bytes], None]], None]
    ) -> None:
        """Take queries on matching keys, as `serve` does, and answer them when the answer is there.

        `asked(key, question, reply)` runs on Zenoh's thread and must not block; `reply(answer)` may be called
        later, once, from any thread. The asker sets how long it waits.
        """

        def heard(query: zenoh.Query) -> None:
            key = str(query.key_expr)
            if "*" in key:
                query.reply_err(f"{key}: one key at a time is answered here")
                return
            question = query.payload

            def reply(answer: bytes) -> None:
                try:
                    query.reply(key, answer)
                    query.drop()  # type: ignore[no-untyped-call]  # as Zenoh types it; the asker waits no longer
                except zenoh.ZError as error:
                    log.debug("nobody waits for the answer on %r any more: %s", key, error)

            try:
                asked(key, b"" if question is None else question.to_bytes(), reply)
            except Exception as error:
                log.exception("answering %r", key[:80])
                line = " ".join(str(error).split())[:200] or type(error).__name__
                reason = f"failed inside: {line}; see the service's log"
                reply(encode(Answer(ok=False, reason=reason)))

        self._keep(self._session.declare_queryable(keys.expression(key_expression), heard))

    def ask(self, key: str, question: bytes = b"", timeout_s: float = 2.0) -> bytes | None:
        """Return the first answer to a query, or None when nobody answers in time."""
        keys.parse(key)
        for reply in self._session.get(
            key, payload=question, timeout=timeout_s, priority=_PRIORITY[Urgency.CONTROL]
        ):
            if reply.ok is not None:
                return reply.ok.payload.to_bytes()
        return None

    def announce(self, key: str) -> Callable[[], None]:
        """Hold a liveliness token on `key` until the returned function is called or the bus is closed."""
        keys.parse(key)
        token = self._session.liveliness().declare_token(key)
        self._keep(token)

        def end() -> None:
            with self._lock:
                held = any(kept is token for kept in self._kept)
                self._kept = [kept for kept in self._kept if kept is not token]
            if held and not self._closed:
                token.undeclare()  # type: ignore[no-untyped-call]  # as Zenoh types it

        return end

    def alive(self, key_expression: str, timeout_s: float = ANSWERED_S) -> list[str]:
        """Return the keys of the tokens that match now; Zenoh may find none on a bus watching them."""
        replies = self._session.liveliness().get(keys.expression(key_expression), timeout=timeout_s)
        return [str(r.ok.key_expr) for r in replies if r.ok is not None]

    def watch_alive(self, key_expression: str, changed: Callable[[str, bool], None]) -> None:
        """Call `changed(key, alive)` on Zenoh's thread for each matching token, those there now included."""

        def heard(sample: zenoh.Sample) -> None:
            changed(str(sample.key_expr), sample.kind == zenoh.SampleKind.PUT)

        tokens = keys.expression(key_expression)
        self._keep(self._session.liveliness().declare_subscriber(tokens, heard, history=True))

    def close(self) -> None:
        """Leave the bus: tokens vanish, retained values are no longer answered. Closing twice is harmless.

        A callback that runs meanwhile is not waited for; what it puts is lost.
        """
        self._closed = True
        try:
            self._session.close()  # type: ignore[no-untyped-call]  # as Zenoh types it
        except zenoh.ZError as error:
            log.debug("closing the session: %s", error)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def _to_do(password: str | None) -> str:
    """Return what may help: Zenoh says the same of a router that is not there and of a wrong password."""
    start = "start one with: brachium router"
    if password:
        return f"{start}; or the room's password is wrong (${PASSWORD_VARIABLE})"
    return f"{start}; or, where the room has a password, set ${PASSWORD_VARIABLE}"
