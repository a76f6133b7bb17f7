"""A SlimeVR tracker, written from the facts of its protocol alone: it imports nothing of ours.

    python slimevr_tracker.py BROADCAST_ADDRESS PORT MAC SENSORS_JSON [--bundle]

SENSORS_JSON lists the body position of each sensor. Orders come as JSON, one a line, on standard input; what
happens is told as JSON on standard output. As real trackers do, it sends
no rotation that is the same as the last.
"""

import json
import os
import select
import socket
import struct
import sys
import time

PERIOD_S = 0.01
SEEK_S = 0.2


class Tracker:
    def __init__(self, broadcast, port, mac, positions, bundle):
        self.seek_at = (broadcast, port)
        self.mac = bytes.fromhex(mac.replace(":", ""))
        self.positions, self.bundle = positions, bundle
        self.frames = []
        self.sent = [None] * len(positions)
        self.lose = 0
        self.mute = False
        self.start()

    def start(self):
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_BROADCAST, 1)
        self.socket.bind(("127.0.0.1", 0))
        self.server, self.number, self.sought_s, self.heard_s = None, 0, 0.0, 0.0
        self.known, self.told_s, self.bundles = set(), 0.0, False

    # -- out ----------------------------------------------------------------------------------------------

    def packet(self, kind, payload):
        self.datagram(struct.pack(">I", kind) + struct.pack(">Q", self.number) + payload)

    def datagram(self, data):
        self.number += 1
        if self.lose:
            self.lose -= 1
        elif self.server and not self.mute:
            self.socket.sendto(data, self.server)

    def handshake(self):
        firmware = b"0.5.4"
        payload = struct.pack(">7I", 1, 10, 2, 0, 0, 0, 22) + bytes([len(firmware)]) + firmware + self.mac
        payload += b"\0" + b"\0" * 5
        self.socket.sendto(struct.pack(">IQ", 3, 0) + payload, self.seek_at)

    def sensor_info(self, sensor):
        told = struct.pack(">BBBHBBB", sensor, 1, 10, 0, 1, self.positions[sensor], 0)
        self.packet(15, told + struct.pack(">ff", 100.0, 100.0))

    def rotations(self, turns):
        """turns: {sensor: [x, y, z, w]}"""
        new = {s: q for s, q in turns.items() if self.sent[s] != q}
        inner = []
        for sensor, xyzw in new.items():
            self.sent[sensor] = xyzw
            inner.append((17, struct.pack(">BB", sensor, 1) + struct.pack(">ffff", *xyzw) + b"\0"))
            inner.append((4, struct.pack(">fff", 0.1, -0.2, 0.3) + bytes([sensor])))
        if self.bundle and self.bundles and inner:
            body = b""
            for kind, payload in inner:
                packet = struct.pack(">I", kind) + payload
                body += struct.pack(">H", len(packet)) + packet
            self.packet(100, body)
        else:
            for kind, payload in inner:
                self.packet(kind, payload)

    # -- in -----------------------------------------------------------------------------------------------

    def hear(self):
        data, sender = self.socket.recvfrom(128)
        if data[:13] == b"\x03Hey OVR =D 5":
            if self.server is None:
                self.server = sender
                tell(joined=sender[1])
            self.heard_s = time.monotonic()
            return
        if sender != self.server:
            return
        self.heard_s = time.monotonic()
        kind = data[3]
        if kind == 1:
            self.packet(0, b"")
        elif kind == 10 and not self.mute:
            self.socket.sendto(data, self.server)
        elif kind == 15:
            if data[4] not in self.known:
                tell(acked=data[4])
            self.known.add(data[4])
        elif kind == 22:
            self.bundles = bool(data[12] & 1)
            tell(features=data[12])

    def obey(self, order):
        if "frames" in order:
            self.frames += order["frames"]
        elif "send" in order:
            kind, payload = order["send"]
            self.packet(kind, bytes.fromhex(payload))
        elif "bytes" in order:
            self.socket.sendto(bytes.fromhex(order["bytes"]), self.server or self.seek_at)
        elif "lose" in order:
            self.lose = order["lose"]
        elif "mute" in order:
            self.mute = order["mute"]
        elif "restart" in order:
            self.socket.close()
            self.sent = [None] * len(self.positions)
            self.start()

    def run(self):
        due, orders = time.monotonic(), b""
        while True:
            ready, _, _ = select.select([0, self.socket], [], [], max(0.0, due - time.monotonic()))
            if 0 in ready:
                said = os.read(0, 1 << 20)
                if not said:
                    return
                *lines, orders = (orders + said).split(b"\n")
                for line in lines:
                    self.obey(json.loads(line))
                continue
            if self.socket in ready:
                self.hear()
            now = time.monotonic()
            if now < due:
                continue
            due += PERIOD_S
            self.live(now)

    def live(self, now):
        if self.server is not None and now - self.heard_s > 3.0:
            self.server = None
            self.known.clear()
            tell(alone=True)
        if self.server is None:
            if now - self.sought_s > SEEK_S:
                self.sought_s = now
                self.handshake()
            return
        if now - self.told_s > 1.0:
            self.told_s = now
            self.packet(22, b"\x02")
            for sensor in range(len(self.positions)):
                if sensor not in self.known:
                    self.sensor_info(sensor)
        if self.frames:
            turns = self.frames.pop(0)
            self.rotations({int(sensor): xyzw for sensor, xyzw in turns.items()})
            if not self.frames:
                tell(played=True)


def tell(**what):
    print(json.dumps(what), flush=True)


if __name__ == "__main__":
    _, broadcast, port, mac, positions, *more = sys.argv
    Tracker(broadcast, int(port), mac, json.loads(positions), "--bundle" in more).run()
