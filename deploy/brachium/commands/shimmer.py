"""Take a Shimmer3 into the network over Bluetooth's serial port.

brachium shimmer --port /dev/rfcomm0 --subject p01.ref --segment forearm_r
"""

import argparse

from brachium.option_types import real
from brachium.shell import Usage, add_network, serve


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    add_network(parser)
    parser.add_argument("--port", required=True, metavar="TTY", help="the serial port, as /dev/rfcomm0")
    parser.add_argument(
        "--subject", required=True, help="whom it is worn by; p01.ref: a second set of sensors on p01"
    )
    parser.add_argument("--segment", required=True, help="where it is worn, as forearm_r")
    parser.add_argument("--id", help="its name (default: shimmer-SUBJECT-SEGMENT)")
    parser.add_argument("--rate", type=real(1.0, 512.0), default=51.2, metavar="HZ", help="samples a second")
    parser.add_argument(
        "--accelerometer", default="wide-range", choices=["wide-range", "low-noise"], help="low-noise: 2 g"
    )
    parser.add_argument(
        "--accel-g", type=int, default=8, choices=[2, 4, 8, 16], help="of the wide-range accelerometer"
    )
    parser.add_argument("--gyro-dps", type=int, default=2000, choices=[250, 500, 1000, 2000], help="range")
    parser.add_argument(
        "--mounting", metavar="W,X,Y,Z", help="nominal, segment from the axes printed on its case"
    )
    parser.add_argument(
        "--origin",
        choices=["worn", "emulated"],
        help="default: worn; emulated where a program stands behind the port",
    )


def run(args: argparse.Namespace) -> int:
    """Start it."""
    from brachium_body.segments import SEGMENTS
    from brachium_nodes.shimmer import service
    from brachium_nodes.shimmer.dialogue import Wish

    if args.segment not in SEGMENTS:
        raise Usage(f"segment {args.segment!r} is not known; choose one of {', '.join(SEGMENTS)}")
    settings = service.ShimmerSettings(
        port=args.port,
        subject=args.subject,
        segment=args.segment,
        endpoint=args.endpoint,
        room=args.room,
        id=args.id or "",
        mounting=None if args.mounting is None else _quaternion(args.mounting),
        origin=args.origin,
        wish=Wish(
            rate_hz=args.rate,
            accelerometer=args.accelerometer,
            accel_g=args.accel_g,
            gyro_dps=args.gyro_dps,
        ),
    )
    return serve(lambda stop: service.run(settings, stop))


def _quaternion(text: str) -> tuple[float, float, float, float]:
    try:
        w, x, y, z = (float(part) for part in text.split(","))
    except ValueError:
        w = x = y = z = 0.0
    if abs(w * w + x * x + y * y + z * z - 1.0) > 1e-3:
        raise Usage(f"--mounting takes four numbers of length 1, as 1,0,0,0; came {text!r}")
    return (w, x, y, z)
