"""An outside client, written from docs/wire.md alone: it knows Zenoh, MessagePack and that page.

python client.py ENDPOINT ROOM COUNT: prints what sensors there are, then COUNT skeletons as lines of text.
"""

import json
import math
import queue
import re
import struct
import sys
import time

import msgpack
import zenoh

CHUNK = re.compile(r"[A-Za-z0-9_-][A-Za-z0-9_.-]{0,63}\Z")
PATIENCE_S = 30.0


def open_session(endpoint):
    settings = {
        "mode": "client",
        "connect": {"endpoints": [endpoint], "timeout_ms": 1000, "exit_on_failure": True},
        "listen": {"endpoints": []},
        "scouting": {"multicast": {"enabled": False}, "gossip": {"enabled": False}},
    }
    give_up = time.monotonic() + PATIENCE_S
    while True:
        try:
            return zenoh.open(zenoh.Config.from_json5(json.dumps(settings)))
        except zenoh.ZError:
            if time.monotonic() > give_up:
                sys.exit(f"no router at {endpoint}")
            time.sleep(0.2)


def read(payload, kind):
    """Return the map of a message, or None when it is of another kind or version."""
    try:
        message = msgpack.unpackb(payload, max_map_len=1024, max_array_len=4096, max_ext_len=0)
    except Exception:
        return None
    return message if isinstance(message, dict) and message.get("m") == kind else None


def parts(key):
    """Return subject, topic and the rest of a key, or None for a key that holds what no key may."""
    root, *rest = key.split("/")
    if root != "brachium" or len(rest) < 3 or not all(CHUNK.match(chunk) for chunk in rest):
        return None
    return rest[1:]


def describe(key, message):
    subject, _, segment, *_ = parts(key)
    w, x, y, z = message.get("mnt", (1.0, 0.0, 0.0, 0.0))
    bias = message.get("cal", {}).get("gyro_bias", (0.0, 0.0, 0.0))
    print(
        f"info {subject} {segment} {message['node']} {message['rate']:g} Hz {message['org']} "
        f"mounting {w:g} {x:g} {y:g} {z:g} bias {bias[0]:g} {bias[1]:g} {bias[2]:g}",
        flush=True,
    )


def show_batch(key, message):
    subject, _, segment = parts(key)
    n = len(message["dt"]) // 4
    offsets = struct.unpack(f"<{n}I", message["dt"])
    if "acc" in message:
        acc = struct.unpack(f"<{3 * n}f", message["acc"])
        last = [round(value, 4) for value in acc[-3:]]
        print(f"imu {subject} {segment} {message['seq']} {message['t'] + offsets[-1]} {last}", flush=True)


def show_skeleton(key, message):
    subject = parts(key)[0]
    elbow = message["ang"].get("elbow_flexion")
    text = "unknown" if elbow is None else f"{math.degrees(elbow):.3f}"
    quality = message.get("aq", {}).get("elbow_flexion", "as its segments")
    print(f"skeleton {subject} {message['t']} {message['side']} elbow {text} {quality}", flush=True)


def main(endpoint, room, count):
    arrived = queue.Queue(maxsize=4096)

    def keep(sample):
        if sample.kind == zenoh.SampleKind.PUT and not arrived.full():
            arrived.put_nowait((str(sample.key_expr), sample.payload.to_bytes()))

    with open_session(endpoint) as session:
        subscriptions = [
            session.declare_subscriber(f"brachium/{room}/*/skeleton/*", keep),
            session.declare_subscriber(f"brachium/{room}/*/imu/*", keep),
        ]
        replies = session.get(f"brachium/{room}/*/imu/*/info", target=zenoh.QueryTarget.ALL, timeout=1.0)
        for reply in replies:
            if reply.ok is not None:
                message = read(reply.ok.payload.to_bytes(), "info/1")
                if message is not None and parts(str(reply.ok.key_expr)):
                    describe(str(reply.ok.key_expr), message)
        print("ready", flush=True)
        while count:
            key, payload = arrived.get(timeout=PATIENCE_S)
            where = parts(key)
            if where is None:
                print("refused a key", flush=True)
            elif where[1] == "imu":
                message = read(payload, "imu/1")
                if message is not None:
                    show_batch(key, message)
            else:
                message = read(payload, "skeleton/1")
                if message is None:
                    print("refused a message", flush=True)
                else:
                    show_skeleton(key, message)
                    count -= 1
        del subscriptions


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], int(sys.argv[3]))
