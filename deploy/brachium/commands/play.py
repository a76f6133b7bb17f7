"""Play a capture folder or a recording as if its sensors were being worn now.

brachium play recording.mcap --speed 2
"""

import argparse
from pathlib import Path

from brachium.shell import add_json, add_network, print_json, stop_on_signals
from brachium.way_in import GATEWAY, add_way_in, node_table, read_token


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    parser.add_argument("input", type=Path, metavar="INPUT", help="a capture folder, or a recording (.mcap)")
    add_network(parser)
    add_way_in(parser)
    parser.add_argument("--subject", default="p01", help="who a capture is of; a recording says it itself")
    add_json(parser)


def run(args: argparse.Namespace) -> int:
    """Play, then tell what was sent."""
    from brachium_nodes import play

    if not args.input.exists():
        raise FileNotFoundError(2, "no such file or folder", str(args.input))
    settings = play.PlaySettings(
        path=args.input,
        endpoint=args.endpoint,
        room=args.room,
        gateway=args.gateway or GATEWAY,
        token=read_token(args),
        direct=args.gateway is None and not args.print_nodes,
        speed=args.speed,
        seconds=args.seconds,
        subject=args.subject,
    )
    if args.print_nodes:
        print(node_table(play.node_entries(settings)))
        return 0
    report = play.run(settings, stop_on_signals())
    if args.json:
        print_json(report)
        return 0
    for subject, streams in report.streams.items():
        for segment, count in streams.items():
            print(f"{subject} {segment}: {count.sent} samples sent, {count.lost} left out")
    return 0
