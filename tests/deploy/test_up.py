"""`brachium up`, as a person runs it: services come, come back when killed, and end together."""

import os
import queue
import re
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from brachium.checks import free_port
from brachium_wire import keys
from brachium_wire.bus import Bus, NoRouter
from brachium_wire.codec import decode
from brachium_wire.messages import Session

pytestmark = [
    pytest.mark.network,
    pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="children are found through /proc"),
]

LONG_S = 60.0


class Up:
    """A running site."""

    def __init__(self, folder: Path, *, password: bool) -> None:
        self.port = free_port()
        site = folder / "gym.toml"
        site.write_text(
            f'[room]\nid = "gym"\nports = {{ router = {self.port}, gateway = {free_port()} }}\n'
            f"password = {str(password).lower()}\n"
            f'recordings = "{folder}/recordings"\n[[subject]]\nid = "p01"\nside = "left"\nheight_m = 1.8\n'
        )
        with (folder / "log").open("w") as log:
            self.process = subprocess.Popen(
                [sys.executable, "-m", "brachium", "up", str(site)],
                stdout=subprocess.PIPE,
                stderr=log,
                text=True,
                env={**os.environ, "XDG_STATE_HOME": str(folder / "state")},
            )
        assert self.process.stdout is not None
        self.said = [self.process.stdout.readline() for _ in range(3)]

    @property
    def endpoint(self) -> str:
        return f"tcp/127.0.0.1:{self.port}"

    def children(self) -> dict[str, int]:
        """Return the services' process numbers by their command."""
        found = {}
        for number in Path(f"/proc/{self.process.pid}/task/{self.process.pid}/children").read_text().split():
            words = Path(f"/proc/{number}/cmdline").read_bytes().decode().split("\0")
            found[words[words.index("brachium") + 1]] = int(number)
        return found

    def end(self) -> int:
        self.process.send_signal(signal.SIGINT)
        self.process.communicate(timeout=LONG_S)
        return self.process.returncode


@pytest.fixture
def site(tmp_path: Path, request: pytest.FixtureRequest) -> Iterator[Up]:
    running = Up(tmp_path, password=getattr(request, "param", False))
    yield running
    if running.process.poll() is None:
        running.end()


def tokens(bus: Bus) -> "queue.Queue[tuple[str, bool]]":
    """Return the coming and going of services, by kind."""
    changes: queue.Queue[tuple[str, bool]] = queue.Queue()
    everyone = keys.services("gym", "*/*/alive")
    bus.watch_alive(everyone, lambda key, up: changes.put((keys.parse(key).detail.split("/")[0], up)))
    return changes


def wait_for(changes: "queue.Queue[tuple[str, bool]]", wanted: set[tuple[str, bool]]) -> None:
    while wanted:
        wanted.discard(changes.get(timeout=LONG_S))


def test_a_killed_service_comes_back_and_nothing_else_is_touched(site: Up):
    assert "router, gateway, fuse, record" in site.said[0]
    with Bus.open(site.endpoint, timeout_s=LONG_S) as bus:
        changes = tokens(bus)
        wait_for(changes, {(kind, True) for kind in ("router", "gateway", "fusion", "recorder")})
        before = site.children()
        os.kill(before["fuse"], signal.SIGKILL)
        wait_for(changes, {("fusion", False)})
        wait_for(changes, {("fusion", True)})
        after = site.children()
    assert after.pop("fuse") != before.pop("fuse")
    assert after == before
    assert site.end() == 0
    assert not any(Path(f"/proc/{number}").exists() for number in after.values())


def test_the_network_is_told_of_the_subjects(site: Up):
    with Bus.open(site.endpoint, timeout_s=LONG_S) as bus:
        inbox = bus.subscribe(keys.session("gym", "p01"))
        found = bus.fetch(keys.session("gym", "p01"))
        if not found:  # it was asked before it was there: then it comes
            assert inbox.wait(LONG_S)
            found = inbox.drain()
    session = decode(found[0][1], Session)
    assert (session.side, session.height_m) == ("left", 1.8)


@pytest.mark.parametrize("site", [True], indirect=True)
def test_with_a_password_only_who_knows_it_attaches(site: Up):
    (password,) = re.findall(r"BRACHIUM_PASSWORD=(\S+)", site.said[2])
    with Bus.open(site.endpoint, timeout_s=LONG_S, password=password) as bus:
        wait_for(tokens(bus), {("fusion", True), ("gateway", True)})
    for wrong in (None, "guess"):
        with pytest.raises(NoRouter):
            Bus.open(site.endpoint, timeout_s=0.0, password=wrong)
    assert password not in " ".join(
        Path(f"/proc/{number}/cmdline").read_text() for number in site.children().values()
    )


def test_a_second_up_says_why_and_starts_nothing(site: Up, tmp_path: Path):
    with Bus.open(site.endpoint, timeout_s=LONG_S) as bus:
        wait_for(tokens(bus), {("recorder", True)})
        second = subprocess.run(
            [sys.executable, "-m", "brachium", "up", str(tmp_path / "gym.toml")],
            capture_output=True,
            text=True,
            timeout=LONG_S,
            check=False,
            env={**os.environ, "XDG_STATE_HOME": str(tmp_path / "state")},
        )
        assert second.returncode == 1
        assert second.stdout == ""
        assert len(second.stderr.splitlines()) == 1
        assert f"port {site.port}" in second.stderr
        with Bus.open(site.endpoint, timeout_s=LONG_S) as other:  # one that does not watch: see Bus.alive
            assert len(other.alive(keys.services("gym", "recorder/*/alive"))) == 1


def test_a_service_that_cannot_start_ends_the_site(tmp_path: Path):
    (tmp_path / "taken").write_text("a file, where the recorder needs a folder")
    site = tmp_path / "gym.toml"
    site.write_text(
        f'[room]\nid = "gym"\nports = {{ router = {free_port()}, gateway = {free_port()} }}\n'
        f'recordings = "{tmp_path}/taken"\n'
    )
    done = subprocess.run(
        [sys.executable, "-m", "brachium", "up", str(site)],
        capture_output=True,
        text=True,
        timeout=LONG_S,
        check=False,
        env={**os.environ, "XDG_STATE_HOME": str(tmp_path / "state")},
    )
    assert done.returncode == 2
    assert "brachium up: record ended (exit 2)" in done.stderr.splitlines()[-1]
    assert "again in" not in done.stderr
