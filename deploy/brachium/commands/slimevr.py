"""Let SlimeVR trackers in: those that are named, by MAC address; others wait and are shown by the monitor.

brachium slimevr --bind 192.168.1.10 --assign a1:b2:c3:d4:e5:f6=p01/forearm_r
  brachium slimevr --site lan.toml
"""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from brachium.option_types import port_or_any
from brachium.shell import add_network, serve

if TYPE_CHECKING:
    from brachium_nodes.slimevr.allowed import Allowed


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    add_network(parser)
    parser.add_argument("--id", default="slimevr", help="names the service and its clock")
    parser.add_argument("--bind", default="127.0.0.1", help="IPv4 address of one interface")
    parser.add_argument(
        "--port", type=port_or_any, default=6969, help="UDP; trackers seek 6969; 0 takes any free one"
    )
    parser.add_argument(
        "--site", type=Path, metavar="FILE.toml", help="the [[tracker]] tables of this site file may join"
    )
    parser.add_argument(
        "--assign",
        action="append",
        default=[],
        metavar="MAC[/SENSOR]=SUBJECT[/SEGMENT]",
        help="let this tracker in, once more for each; without a segment each of its sensors goes "
        "where the tracker says that it is worn",
    )


def run(args: argparse.Namespace) -> int:
    """Start the service."""
    from brachium_nodes.slimevr import service
    from brachium_nodes.slimevr.allowed import from_text

    settings = service.SlimeVRSettings(
        endpoint=args.endpoint,
        room=args.room,
        id=args.id,
        bind=args.bind,
        port=args.port,
        trackers=(*_of_site(args.site), *map(from_text, args.assign)),
    )
    return serve(lambda stop: service.run(settings, stop))


def _of_site(site: Path | None) -> "list[Allowed]":
    if site is None:
        return []
    from brachium import site_file
    from brachium_nodes.slimevr.allowed import Allowed

    return [
        Allowed(
            mac=tracker.mac,
            sensor=tracker.sensor,
            subject=tracker.subject,
            segment=tracker.segment,
            mounting=tracker.mounting,
            rate_hz=tracker.rate_hz,
        )
        for tracker in site_file.read(site_file.find(str(site))).tracker
    ]
