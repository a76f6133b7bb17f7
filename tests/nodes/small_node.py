"""A node in a few lines, by docs/node-protocol.md alone: standard library and msgpack, nothing of ours.

small_node.py HOST PORT ID TOKEN [WRONG]: with WRONG it breaks one rule; "seek" makes it look for its gateway.
"""

import base64
import hashlib
import hmac
import json
import os
import random
import select
import signal
import socket
import struct
import sys
import time

import msgpack

RATE, N = 100, 5
SHORTEST_S, LONGEST_S = 0.3, 3.0  # pauses, each three times the one before: no hold-up turns their order
host, port, node, token = sys.argv[1], int(sys.argv[2]), sys.argv[3], sys.argv[4]
wrong = sys.argv[5] if len(sys.argv) > 5 else ""
seek_port = int(sys.argv[6]) if len(sys.argv) > 6 else 0
boot = random.getrandbits(32)
stopped = []
signal.signal(signal.SIGTERM, lambda *_: stopped.append(1))
start = time.monotonic()
calibration = {}


class Gone(Exception):
    def __init__(self, wait=0.0):
        self.wait = wait


def now_us():
    us = (time.monotonic() - start) * 1e6 + 5e6
    return int(us * 1.0035 if wrong == "clock rate" else us)


def status():
    return {
        "m": "status/1",
        "bat": 3.9,
        "rssi": 1e9 if wrong == "status fields" else -50.0,
        "drop": 0 if wrong == "drops" else taking.dropped,
    }


class Taking:
    """What the sensor has measured: batches that wait, some four seconds of them."""

    def __init__(self):
        self.next, self.dropped, self.waiting = 0, 0, []

    def measure(self, connected):
        # A batch is there when its last sample is; in the node's own clock, at its own rate.
        rate = RATE / 2 if wrong == "rate" else RATE
        while (self.next + N) / rate < (now_us() - 5e6) / 1e6:
            begun = int(5e6 + 1e6 * self.next / rate)
            self.waiting.append([self.next, begun, int(1e6 / rate), not connected])
            self.next += N
            self.next += wrong == "sequence" and self.next // N % 50 == 0
            if len(self.waiting) > 4 * RATE / N:
                self.waiting.pop(0)
                self.dropped += N


taking = Taking()


def batch(sequence, begun, step, late):
    acc = struct.pack("<3f", 0.0, 0.0, float("nan") if wrong == "batches" else 9.8) * N
    if wrong == "device time":
        begun = 5_000_000 + (begun - 5_000_000) % 2_000_000
    if wrong == "fresh":
        begun += 30_000_000
    made = {
        "m": "batch/1",
        "seq": sequence,
        "t": begun,
        "dt": struct.pack(f"<{N}I", *(step * k for k in range(N))),
        "acc": acc,
        "gyr": bytes(12 * N),
    }
    # What waited before its first gateway is marked by every node: unmarked it would be no longer fresh, too.
    if late and not (wrong == "late" and calibration):
        made["late"] = True
    return made


class Link:
    def __init__(self):
        self.way = socket.create_connection((host, port), 5)
        if wrong != "no delay":
            self.way.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.rest, self.sent, self.heard, self.silent = b"", 0, time.monotonic(), time.monotonic()
        path = "/" if wrong == "request" else "/node"
        bearer = "" if wrong == "token" else f"Authorization: Bearer {token}\r\n"
        key = base64.b64encode(os.urandom(16)).decode()
        self.way.sendall(
            f"GET {path} HTTP/1.1\r\nHost: {host}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
            f"Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: {key}\r\n{bearer}\r\n".encode()
        )
        while b"\r\n\r\n" not in self.rest:
            data = self.way.recv(4096)
            if not data:
                raise Gone
            self.rest += data
        head, _, self.rest = self.rest.partition(b"\r\n\r\n")
        if b" 101 " not in head.split(b"\r\n")[0]:
            raise Gone

    def frame(self, kind, payload):
        key = os.urandom(4)
        masked = bytes(b ^ key[i % 4] for i, b in enumerate(payload))
        size = len(payload)
        length = bytes([0x80 | size]) if size < 126 else struct.pack(">BH", 0xFE, size)
        if wrong == "frames" and kind == 2 and self.sent == 20:
            self.way.sendall(
                bytes([0x82, size & 127 if size < 126 else 5]) + payload[: size if size < 126 else 5]
            )
        elif wrong == "mixed" and kind == 2 and self.sent == 20:
            whole = bytes([0x80 | kind]) + length + key + masked
            self.way.sendall(whole[: size // 2] + whole + whole[size // 2 :])
        else:
            self.way.sendall(bytes([0x80 | kind]) + length + key + masked)
        self.sent += 1

    def say(self, message):
        self.frame(2, msgpack.packb(message))

    def read(self, seconds):
        """Return what came: (kind, payload), at most one."""
        if len(self.rest) < 2 or len(self.rest) < 2 + (self.rest[1] & 127):
            if not select.select([self.way], [], [], seconds)[0]:
                return None
            data = self.way.recv(4096)
            if not data:
                raise Gone
            self.rest += data
        if len(self.rest) < 2:
            return None
        size, at = self.rest[1] & 127, 2
        if size == 126:
            size, at = int.from_bytes(self.rest[2:4], "big"), 4
        if len(self.rest) < at + size:
            return None
        kind, payload = self.rest[0] & 15, self.rest[at : at + size]
        self.rest = self.rest[at + size :]
        return kind, payload


def hello():
    made = {"m": "hello/1", "id": node, "chip": "MPU-9150", "rate": float(RATE), "org": "emulated"}
    made["boot"] = random.getrandbits(32) if wrong == "boot" else boot
    if wrong == "hello":
        made["rate"] = 0.0
    if calibration and wrong != "keep":
        made["cal"] = calibration
    return made


def answer(link, said):
    if wrong == "clock answered":
        return
    if wrong == "clock prompt":
        time.sleep(0.15)
    came = now_us()
    if wrong == "clock order":
        came += 400_000
    link.say({"m": "clock/1", "id": said["id"], "t1": came, "t2": now_us()})


def take(link, kind, payload):
    if kind == 9:
        link.frame(10, b"other" if wrong == "pong" else payload)
    elif kind == 8:
        if wrong != "close":
            link.frame(8, payload[:2])
        raise Gone(link.wait if hasattr(link, "wait") else 0.0)
    elif kind == 2:
        said = msgpack.unpackb(payload)
        if said["m"] == "clock/1":
            link.heard = time.monotonic()
            answer(link, said)
        elif said["m"] == "keep/1":
            calibration.update(json.loads(said["cal"]))
            link.say({"m": "kept/1"})
        elif said["m"] == "refused/1" and wrong != "retry":
            link.wait = said.get("retry", 10.0)
        elif said["m"] not in ("welcome/1", "refused/1") and wrong == "unknown":
            raise Gone


def converse(link):
    global pause
    pause = SHORTEST_S
    link.say(hello())
    told, first = time.monotonic() - 2.0, True
    while not stopped:
        got = link.read(0.002)
        if got is not None:
            take(link, *got)
        if wrong != "return after silence" and time.monotonic() - link.heard > 6.0:
            raise Gone
        taking.measure(connected=not first)
        first = False
        while taking.waiting:
            link.say(batch(*taking.waiting[0]))
            taking.waiting.pop(0)
        if time.monotonic() - told > (2.8 if wrong == "status" else 1.0):
            told = time.monotonic()
            link.say(status())
            if wrong == "messages":
                link.frame(1, b'{"m": "status/1"}')
    link.say({"m": "bye/1", "next": taking.next - 50 if wrong == "bye" else taking.next})
    link.way.settimeout(2)
    link.read(2)


def find():
    """Return port of a gateway that proved itself."""
    key = hashlib.sha256(token.encode()).hexdigest().encode()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as way:
        way.setsockopt(socket.SOL_SOCKET, socket.SO_BROADCAST, 1)
        way.settimeout(0.5)
        while not stopped:
            nonce = os.urandom(8).hex()
            way.sendto(
                json.dumps({"m": "seek/1", "id": node, "nonce": nonce}).encode(),
                ("127.255.255.255", seek_port),
            )
            try:
                said = json.loads(way.recv(512))
            except TimeoutError:
                continue
            proof = hmac.new(key, f"{nonce} {said['url']}".encode(), hashlib.sha256).hexdigest()
            if wrong == "proof" or proof == said["proof"]:
                return int(said["url"].rpartition(":")[2].partition("/")[0])
    sys.exit(0)


if seek_port:
    port = find()
pause = SHORTEST_S
while not stopped:
    told = 0.0
    try:
        converse(Link())
    except Gone as gone:
        told = gone.wait
    except ConnectionResetError:
        if wrong == "return after reset":
            time.sleep(60)
    except OSError:
        pass
    if stopped:
        break
    if wrong == "return after close" and calibration and not told:
        time.sleep(60)
    end = time.monotonic() + (
        0.05 if wrong == "back-off" and not told else max(told, pause * random.uniform(0.8, 1.2))
    )
    while time.monotonic() < end and not stopped:
        taking.measure(connected=False)
        time.sleep(0.01)
    pause = min(3 * pause, LONGEST_S)
