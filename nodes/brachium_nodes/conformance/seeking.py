"""A node that looks for its gateway: answered first by a liar, then by the one that knows its token."""

import hashlib
import json
import socket
import time

from brachium_nodes.conformance.acts import Play
from brachium_nodes.conformance.rules import failed, judged
from brachium_nodes.discovery import answer

LIES = 2


def proof(play: Play, port: int) -> None:
    """Listen where it asks; a call that follows a lie is the rule's end."""
    key = hashlib.sha256(play.trial.token.encode()).hexdigest()
    url = f"ws://127.0.0.1:{play.stage.port}/node"
    told, asked = 0, False
    end_s = time.monotonic() + play.trial.patience.start_s
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as door:
        door.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        door.bind(("127.255.255.255", port))
        door.settimeout(0.02)
        while time.monotonic() < end_s:
            caller = play.stage.accept(0.02)
            if caller is not None:
                lied = told <= LIES
                play.stage.first = caller
                fault = "it came to a gateway that had proved nothing" if lied else ""
                play.verdicts.append(judged("proof", fault, f"found, after {LIES} lies"))
                return
            try:
                question, where = door.recvfrom(2048)
            except TimeoutError:
                continue
            said = answer(question, url, lambda node: key if node == play.trial.node else None)
            if said is None:
                continue
            asked = True
            if told < LIES:
                said = json.dumps({**json.loads(said), "proof": "0" * 64}).encode()
            door.sendto(said, where)
            told += 1
    play.verdicts.append(failed("proof", "it never came" if asked else "no question that can be answered"))
