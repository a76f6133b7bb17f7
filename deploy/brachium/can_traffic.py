"""The other side of a CAN bus, for measurements: sensors that send, and a reader that does nothing else.

`python -m brachium.can_traffic PORT --send SENSORS HZ`, or without --send.
"""

import argparse
import struct
import time

from brachium.shell import stop_on_signals

GROUP = "239.74.163.2"
STEP_IDS = 0x100
"""Between the ids of one sensor and the next, beyond 11 bits from the eighth on: ids of 29 bits."""
FRAMES = 4
"""Of one sample: time, angular rate, acceleration, field."""


def main() -> None:
    """Send or receive until stopped."""
    parser = argparse.ArgumentParser()
    parser.add_argument("port", type=int)
    parser.add_argument("--send", nargs=2, type=int, metavar=("SENSORS", "HZ"))
    args = parser.parse_args()
    stop = stop_on_signals()
    import can

    with can.Bus(interface="udp_multicast", channel=GROUP, port=args.port, hop_limit=0) as bus:
        if args.send is None:
            while not stop.is_set():
                bus.recv(0.1)
            return
        sensors, rate_hz = args.send
        begun, tick = time.monotonic(), 0
        while not stop.wait(max(0.0, begun + tick / rate_hz - time.monotonic())):
            for sensor in range(sensors):
                for number, data in sample(tick, rate_hz):
                    frame = can.Message(
                        arbitration_id=number + STEP_IDS * sensor, is_extended_id=True, data=data, check=False
                    )
                    bus.send(frame)
            tick += 1


def sample(tick: int, rate_hz: int) -> list[tuple[int, bytes]]:
    """Return the frames of one sample of an MTi-600 at rest (x up): (id without the sensor's part, data)."""
    return [
        (0x005, struct.pack(">I", tick * 10_000 // rate_hz % (1 << 32))),
        (0x032, struct.pack(">3h", tick % 7, -(tick % 5), tick % 3)),
        (0x034, struct.pack(">3h", 2511, tick % 11, -(tick % 13))),
        (0x041, struct.pack(">3h", 400, 20, -900)),
    ]


if __name__ == "__main__":
    main()
