"""A node that knows no address finds its gateway; nobody else is told, and nobody else can answer for it."""

import hashlib
import hmac
import json
import socket

import pytest
from hypothesis import given
from hypothesis import strategies as st

from brachium_nodes.discovery import answer
from brachium_nodes.gateway import token_sha256
from brachium_nodes.roster import NodeEntry, Roster

URL = "ws://127.0.0.1:8765/node"
KNOWN = Roster((NodeEntry(id="n1", token_sha256=token_sha256("secret")),))


def question(**fields: object) -> bytes:
    return json.dumps({"m": "seek/1", "id": "n1", "nonce": "0123456789abcdef", **fields}).encode()


def test_the_answer_proves_that_the_gateway_knows_the_token():
    said = json.loads(answer(question(), URL, KNOWN.token_of))
    key = hashlib.sha256(b"secret").hexdigest().encode()
    expected = hmac.new(key, f"0123456789abcdef {URL}".encode(), "sha256").hexdigest()
    assert said == {"m": "here/1", "url": URL, "proof": expected}


@pytest.mark.parametrize(
    "bad",
    [
        question(id="stranger"),
        question(id=1),
        question(nonce="short"),
        question(nonce="x" * 65),
        question(m="seek/2"),
        question(more="x" * 300),
        b"[]",
        b"\xff",
        b"",
        b"[" * 250,
    ],
)
def test_what_is_no_question_of_a_known_node_gets_no_answer(bad: bytes):
    assert answer(bad, URL, KNOWN.token_of) is None


@given(st.binary(max_size=300))
def test_no_bytes_break_it(data: bytes):
    assert answer(data, URL, KNOWN.token_of) is None


def test_a_new_node_with_the_joining_token_is_answered():
    roster = Roster((), join_token_sha256=token_sha256("join"))
    assert answer(question(id="new"), URL, roster.token_of) is not None


@pytest.mark.network
def test_a_gateway_hears_broadcasts_on_its_interface(gateway, free_port):
    running = gateway(NodeEntry(id="n1", token_sha256=token_sha256("secret")), discovery_port=free_port)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as asking:
        asking.settimeout(60.0)
        asking.setsockopt(socket.SOL_SOCKET, socket.SO_BROADCAST, 1)
        asking.sendto(question(id="stranger"), ("127.255.255.255", free_port))
        asking.sendto(question(), ("127.255.255.255", free_port))
        said = json.loads(asking.recv(1024))
    assert said["url"] == running.url


@pytest.mark.network
def test_a_port_that_another_gateway_has_is_told_with_what_to_do(gateway, free_port, caplog):
    node = NodeEntry(id="n1", token_sha256=token_sha256("secret"))
    gateway(node, discovery_port=free_port)
    second = gateway(node, id="second", discovery_port=free_port)
    (said,) = [record.getMessage() for record in caplog.records if record.name.endswith("discovery")]
    assert f"UDP port {free_port} are not heard (Address already in use)" in said
    assert "another --discovery-port" in said
    assert f'"gateway": "{second.url}"' in said
