import json
import os
import subprocess
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from brachium_nodes.firmware_build import Build, NoMicroPython, build, micropython
from brachium_nodes.gateway import GatewaySettings, run
from brachium_nodes.roster import NodeEntry
from brachium_wire import keys
from brachium_wire.bus import Bus
from brachium_wire.codec import WireError, decode_topic
from brachium_wire.messages import Health, Status

DEADLINE_S = 60.0
ROOM = "test"
ENDS_WITHIN_S = 15.0
"""A service promises 2 s; a machine with much to do takes some times that. One that hangs is not excused."""


def until(condition: Callable[[], object], what: str) -> None:
    deadline = time.monotonic() + DEADLINE_S
    pause = threading.Event()
    while not condition():
        assert time.monotonic() < deadline, f"waited {DEADLINE_S:g} s for: {what}"
        pause.wait(0.01)


@pytest.fixture
def free_port(unused_port: Callable[[], int]) -> int:
    return unused_port()


@pytest.fixture
def bus(endpoint: str) -> Iterator[Bus]:
    with Bus.open(endpoint) as bus:
        yield bus


@pytest.fixture
def waiting() -> Callable[[Callable[[], object], str], None]:
    return until


class Listener:
    """Everything that the room said since it was made."""

    def __init__(self, bus: Bus, room: str = ROOM) -> None:
        self._inbox = bus.subscribe(keys.everything(room))
        self.heard: list[tuple[keys.Key, object]] = []
        self.raw: list[tuple[str, bytes, object]] = []

    def of(self, topic: str, detail: str | None = None) -> list:
        for key, payload in self._inbox.drain():
            parsed = keys.parse(key)
            try:
                message = decode_topic(payload, parsed.topic)
            except WireError as error:
                raise AssertionError(f"{key}: {error}") from error
            self.heard.append((parsed, message))
            self.raw.append((key, payload, message))
        return [m for k, m in self.heard if k.topic == topic and detail in (None, k.detail)]

    def until(self, condition: Callable[[], object], what: str) -> None:
        until(condition, what)

    def until_gone(self, nodes: int) -> dict[tuple[str, str], Status]:
        """Wait for the last status of so many nodes; return it by subject and segment."""

        def gone() -> dict[tuple[str, str], Status]:
            self.of("status")
            return {
                (k.subject, k.detail): m for k, m in self.heard if isinstance(m, Status) and not m.connected
            }

        until(lambda: len(gone()) == nodes, f"the last status of {nodes} nodes")
        return gone()


@pytest.fixture
def listener(bus: Bus) -> Listener:
    return Listener(bus)


class Running:
    """A gateway in a thread."""

    def __init__(self, settings: GatewaySettings, bus: Bus) -> None:
        self.stop = threading.Event()
        self.error: Exception | None = None
        self._inbox = bus.subscribe(keys.service(settings.room, "gateway", settings.id))
        self._thread = threading.Thread(target=self._run, args=(settings,))
        self._thread.start()
        self.url = ""
        until(self._listening, f"gateway {settings.id} listening")

    def _run(self, settings: GatewaySettings) -> None:
        try:
            run(settings, self.stop)
        except Exception as error:
            self.error = error

    def _listening(self) -> bool:
        assert self.error is None, self.error
        for _, payload in self._inbox.drain():
            health = decode_topic(payload, "health")
            assert isinstance(health, Health)
            self.url = health.text
        return bool(self.url)

    def end(self) -> None:
        self.stop.set()
        self._thread.join(timeout=ENDS_WITHIN_S)
        assert not self._thread.is_alive(), "the gateway did not end"
        assert self.error is None, self.error


@pytest.fixture
def gateway(endpoint: str, bus: Bus) -> Iterator[Callable[..., Running]]:
    running: list[Running] = []

    def start(*nodes: NodeEntry, id: str = "gw-a", **more: object) -> Running:
        settings = GatewaySettings(
            **{"endpoint": endpoint, "room": ROOM, "id": id, "port": 0, "nodes": nodes} | more
        )
        running.append(Running(settings, bus))
        return running[-1]

    yield start
    for one in running:
        one.end()


@pytest.fixture(scope="session")
def firmware(tmp_path_factory: pytest.TempPathFactory) -> Build:
    """The files that are flashed; where everything must run, a missing interpreter is a failure."""
    try:
        return build(tmp_path_factory.mktemp("firmware"))
    except NoMicroPython as error:
        if os.environ.get("CI") == "true":
            pytest.fail(str(error))
        pytest.skip(str(error))


HEAD = """
import json, sys
sys.path.insert(0, sys.argv[1])
with open('given.json') as file:
    given = json.load(file)
"""


@pytest.fixture
def on_chip(firmware, tmp_path: Path) -> Callable[..., Any]:
    """Run a few lines on MicroPython; they find `given` and say their answer as JSON."""

    def run(lines: str, given: object = None, files: dict[str, object] | None = None) -> Any:
        for name, content in {"given.json": given, **(files or {})}.items():
            (tmp_path / name).write_text(json.dumps(content))
        program = tmp_path / "program.py"
        program.write_text(HEAD + lines)
        words = [*micropython(), str(program), str(firmware.firmware)]
        done = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, timeout=60, check=False)
        assert done.returncode == 0, done.stdout + done.stderr
        return json.loads(done.stdout.strip().splitlines()[-1])

    return run
