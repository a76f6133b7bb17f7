"""A node is told about itself: by its page, by its serial line, and by nobody who means harm."""

import errno
import http.client
import json
import os
import pty
import socket
import threading
import time
import tty
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import urlencode

import pytest

from brachium_nodes.emulated_board.settings import BoardSettings
from brachium_nodes.firmware_host import FirmwareNode, prepare
from brachium_nodes.gateway import token_sha256
from brachium_nodes.roster import NodeEntry
from brachium_nodes.serial_setup import NotTold, open_serial, tell
from brachium_nodes.wearer import Wearer, WearerSettings

pytestmark = pytest.mark.network

WITHIN_S = 60.0
FORM = {
    "wifi_name": "gym & co",
    "wifi_password": "päss word 1",
    "id": "esp-3f21",
    "token": "s3cret",
    "rate_hz": "50",
}


class Flash:
    """A new node's folder, and its page."""

    def __init__(self, folder: Path, port: int) -> None:
        self.folder, self.port = folder, port
        wearer = Wearer(WearerSettings(rate_hz=50.0, mag_every=1, segments=("forearm_r",), level="ideal"))
        prepare(
            folder, "unset", "unset", wearer, "forearm_r", seconds=30.0,
            start_us=time.monotonic_ns() // 1000, board=BoardSettings(web_port=port),
        )  # fmt: skip
        self.file = folder / "brachium.json"
        self.file.unlink()

    def kept(self) -> dict:
        return json.loads(self.file.read_text())

    def ask(self, method: str, path: str, body: str | None = None) -> tuple[int, str]:
        line = http.client.HTTPConnection("127.0.0.1", self.port, timeout=10)
        line.request(method, path, body, {"User-Agent": "x" * 200, "Accept-Language": "y" * 200})
        answer = line.getresponse()
        return answer.status, answer.read().decode()


@pytest.fixture
def flash(tmp_path: Path, free_port: int) -> Flash:
    return Flash(tmp_path / "node", free_port)


@pytest.fixture
def node(firmware, flash: Flash, waiting) -> Iterator[FirmwareNode]:
    node = FirmwareNode.start(flash.folder, firmware)
    try:
        waiting(lambda: "one line" in node.said(), "the node's page")
        yield node
    finally:
        node.stop()


def test_a_new_node_is_told_by_its_page_and_joins(
    flash: Flash, node: FirmwareNode, gateway, listener
) -> None:
    assert "there is no brachium.json yet" in node.said()
    assert "Wi-Fi brachium-e53f21 with the password " in node.said()
    status, page = flash.ask("GET", "/")
    assert status == 200
    assert all(f"name={name}" in page for name in FORM)
    entry = NodeEntry(id="esp-3f21", token_sha256=token_sha256("s3cret"), subject="p01", segment="forearm_r")
    url = gateway(entry).url
    status, page = flash.ask("POST", "/save", urlencode({**FORM, "gateway": url}))
    assert (status, "Kept" in page) == (200, True)
    listener.until(lambda: listener.of("imu", "forearm_r"), "samples of a node that was told")
    assert flash.kept() == {
        "wifi": {"name": "gym & co", "password": "päss word 1"},
        "id": "esp-3f21", "token": "s3cret", "gateway": url, "rate_hz": 50, "batch": 5,
    }  # fmt: skip
    assert [path.name for path in flash.folder.glob("brachium.*")] == ["brachium.json"]


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"id": ""}, "&#x27;id&#x27; is missing"),
        ({"id": "a b"}, "letters, digits"),
        ({"token": "ä"}, "plain letters"),
        ({"token": "x\r\nHost: y"}, "plain letters"),
        ({"gateway": "http://x"}, "ws://"),
        ({"wifi_password": "short"}, "8 to 63"),
        ({"rate_hz": "many"}, "invalid"),
        ({"id": "<script>"}, "letters"),
    ],
)
def test_what_cannot_be_is_refused_with_its_reason(on_form, change, said) -> None:
    status, page = on_form({**FORM, **change})
    assert status == 400
    assert said.replace("&#x27;", "'") in page
    assert "<script>" not in page


@pytest.fixture(scope="module")
def on_form(firmware, tmp_path_factory, unused_port):
    """One node for all refusals: it stays."""
    flash = Flash(tmp_path_factory.mktemp("form") / "node", unused_port())
    node = FirmwareNode.start(flash.folder, firmware)
    try:
        deadline = time.monotonic() + WITHIN_S
        while "one line" not in node.said():
            assert time.monotonic() < deadline
            time.sleep(0.01)
        yield lambda fields: flash.ask("POST", "/save", urlencode(fields))
    finally:
        node.stop()
    assert not flash.file.exists()


HOSTILE = {
    "nothing": b"",
    "noise": os.urandom(200) + b"\r\n\r\n",
    "endless line": b"GET /" + b"a" * 20_000,
    "endless head": b"GET / HTTP/1.1\r\n" + b"X: y\r\n" * 4000,
    "huge body": b"POST /save HTTP/1.1\r\nContent-Length: 999999999\r\n\r\n" + b"z" * 9000,
    "negative body": b"POST /save HTTP/1.1\r\nContent-Length: -5\r\n\r\nabc",
    "no length": b"POST /save HTTP/1.1\r\nContent-Length: many\r\n\r\nabc",
    "cut body": b"POST /save HTTP/1.1\r\nContent-Length: 50\r\n\r\nid=",
    "bad escapes": b"POST /save HTTP/1.1\r\nContent-Length: 11\r\n\r\nid=%zz&%=%f",
    "bad text": b"POST /save HTTP/1.1\r\nContent-Length: 9\r\n\r\nid=%ff%fe",
    "another page": b"GET /../../etc/passwd HTTP/1.0\r\n\r\n",
}


HUNG_UP = (errno.ECONNRESET, errno.EPIPE, errno.ENOTCONN)
"""What a socket says of an other end that went first: it depends on what was asked of it then."""


def test_nobody_on_its_page_can_kill_it(flash: Flash, node: FirmwareNode) -> None:
    for said in HOSTILE.values():
        with socket.create_connection(("127.0.0.1", flash.port), timeout=10) as line:
            try:
                line.sendall(said)
                line.shutdown(socket.SHUT_WR)
                while line.recv(4096):
                    pass
            except OSError as error:
                if error.errno not in HUNG_UP:
                    raise
    with socket.create_connection(("127.0.0.1", flash.port), timeout=10) as silent:
        silent.sendall(b"GET / HTTP")  # and then nothing, for as long as the node has patience
        assert flash.ask("GET", "/")[0] == 200
    assert node.process.poll() is None
    assert not flash.file.exists()


def test_a_node_at_work_is_told_anew_over_its_serial_line(firmware, flash: Flash, gateway, listener) -> None:
    entries = [
        NodeEntry(id=name, token_sha256=token_sha256(f"token of {name}"), subject="p01", segment="forearm_r")
        for name in ("old", "new")
    ]
    url = gateway(*entries).url
    about = {"id": "old", "token": "token of old", "gateway": url, "rate_hz": 50}
    flash.file.write_text(json.dumps(about))
    here, there = pty.openpty()
    tty.setraw(there)
    node = FirmwareNode.start(flash.folder, firmware, serial=here)
    port = os.ttyname(there)
    line = open_serial(port)
    try:
        listener.until(lambda: listener.of("imu"), "samples of the old id")
        with pytest.raises(NotTold, match="'id' is missing"):
            tell(line, {**about, "id": ""})
        assert flash.kept() == about
        tell(line, {**about, "id": "new", "token": "token of new"})
        listener.until(lambda: "new" in {i.node for i in listener.of("info")}, "the new id")
        assert flash.kept()["id"] == "new"
        before = len(listener.of("imu"))
        listener.until(lambda: len(listener.of("imu")) > before, "samples of the new id")
    finally:
        drain = threading.Thread(target=_drain, args=(line,), daemon=True)
        drain.start()
        report = node.stop()
        for descriptor in (here, there):
            os.close(descriptor)
        drain.join(15.0)
        os.close(line)
    assert report.restarts == 2  # into the setup, and to work


def _drain(line: int) -> None:
    """Read what the node says, so that it is never held up."""
    try:
        while os.read(line, 4096):
            pass
    except OSError:
        pass


def test_a_line_that_is_no_nodes_is_said() -> None:
    here, there = pty.openpty()
    try:
        with pytest.raises(NotTold, match="says nothing"):
            tell(there, {}, timeout_s=0.2)
        with pytest.raises(NotTold, match="cannot be used"):
            open_serial("/dev/null/nothing")
    finally:
        os.close(here)
        os.close(there)
