"""The floor that fusion is measured beside: a bare Zenoh relay of the same sensor batches, and nothing else.

python -m brachium.bench_relay ENDPOINT ROOM
"""

import sys

import zenoh

from brachium.shell import stop_on_signals
from brachium_wire import keys
from brachium_wire.bus import client_config

INTO = "relay"
"""The room the batches are put into."""


def main(endpoint: str, room: str) -> None:
    """Relay until SIGTERM."""
    stop = stop_on_signals()
    publishers: dict[str, zenoh.Publisher] = {}

    def relay(sample: zenoh.Sample) -> None:
        name = str(sample.key_expr)
        if name not in publishers:
            key = keys.parse(name)
            into = keys.imu(INTO, key.subject, key.detail)
            publishers[name] = session.declare_publisher(
                into, congestion_control=zenoh.CongestionControl.DROP
            )
        publishers[name].put(sample.payload)

    with zenoh.open(client_config(endpoint)) as session:
        session.declare_subscriber(keys.subjects(room, "imu/*"), relay)
        stop.wait()


if __name__ == "__main__":
    main(*sys.argv[1:])
