"""Run a CAN interface: inertial sensors on it come in, joint angles for a machine go out, or both.

brachium can --channel can0 --in sensors.toml
  brachium can --channel can0 --out joints.toml
  brachium can --channel can0 --fd --in sensors.toml --out joints.toml
"""

import argparse
from pathlib import Path

from brachium.option_types import folder, port, whole
from brachium.shell import Usage, add_network, serve


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the interface's options."""
    add_network(parser)
    parser.add_argument("--id", default="can", help="names the service and its clock")
    parser.add_argument(
        "--interface", default="socketcan", help="python-can's name for the kind of interface"
    )
    parser.add_argument("--channel", default="can0", help="which of them")
    parser.add_argument("--bitrate", type=whole(1000, 1_000_000), help="bit/s; socketcan: set with ip link")
    parser.add_argument(
        "--data-bitrate", type=whole(1000, 8_000_000), help="bit/s of the data part of CAN FD"
    )
    parser.add_argument("--fd", action="store_true", help="CAN FD: one frame of 64 bytes an arm goes out")
    parser.add_argument("--port", type=port, help="UDP port, for the interface udp_multicast")
    parser.add_argument(
        "--in",
        dest="sensors",
        type=Path,
        metavar="SENSORS.toml",
        help="which sensors come in, and where they sit",
    )
    parser.add_argument(
        "--out", dest="joints", type=Path, metavar="JOINTS.toml", help="which arm goes out, and how"
    )
    parser.add_argument(
        "--origin",
        action="append",
        choices=["emulated", "playback"],
        default=[],
        help="let an arm that nobody wears be valid for a machine too: for trying things out",
    )
    parser.add_argument("--dbc", type=Path, help="of the sensors, in place of the one that their map names")
    parser.add_argument("--batch", type=whole(1, 64), default=5, help="samples in a packet on the network")
    parser.add_argument(
        "--calibrations", type=folder, metavar="DIR", help="sensor calibrations, as for the gateway"
    )


def run(args: argparse.Namespace) -> int:
    """Serve the interface."""
    if args.sensors is None and args.joints is None:
        raise Usage("say what the interface is for: --in SENSORS.toml, --out JOINTS.toml, or both")
    from brachium_nodes.can import service
    from brachium_nodes.can.port import PortSettings

    settings = service.CanSettings(
        endpoint=args.endpoint,
        room=args.room,
        id=args.id,
        port=PortSettings(
            interface=args.interface,
            channel=args.channel,
            bitrate=args.bitrate,
            data_bitrate=args.data_bitrate,
            fd=args.fd,
            port=args.port,
        ),
        sensors=args.sensors,
        dbc=args.dbc,
        batch=args.batch,
        calibrations=args.calibrations,
        joints=args.joints,
        origins=frozenset({"worn", *args.origin}),
    )
    return serve(lambda stop: service.run(settings, stop))
