"""Show in the terminal what is on the network: who is live, how fast, how late, who waits.

brachium monitor --seconds 10
"""

import argparse

from brachium.option_types import duration_s
from brachium.shell import add_json, add_network, serve


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the monitor's options."""
    add_network(parser)
    add_json(parser)
    parser.add_argument("--seconds", type=duration_s, help="how long (default: until Ctrl-C)")


def run(args: argparse.Namespace) -> int:
    """Watch the room."""
    from brachium_viewer import monitor

    settings = monitor.MonitorSettings(
        endpoint=args.endpoint, room=args.room, json=args.json, seconds=args.seconds
    )
    return serve(lambda stop: monitor.run(settings, stop))
