"""Record a room to an MCAP file until Ctrl-C or for a time.

brachium record --out recordings --seconds 60
"""

import argparse
from pathlib import Path

from brachium.option_types import duration_s, folder
from brachium.shell import Failed, add_json, add_network, print_json, stop_on_signals


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the recorder's options."""
    add_network(parser)
    add_json(parser)
    parser.add_argument("--subject", help="only this subject and the services (default: everybody)")
    parser.add_argument(
        "--out", type=folder, default=Path("recordings"), metavar="DIR", help="where the file goes"
    )
    parser.add_argument("--seconds", type=duration_s, help="how long (default: until Ctrl-C)")
    parser.add_argument("--id", default="main", help="this recorder's name")


def run(args: argparse.Namespace) -> int:
    """Record, then say what the file holds."""
    from brachium_viewer import recorder

    settings = recorder.RecordSettings(
        endpoint=args.endpoint,
        room=args.room,
        subject=args.subject,
        folder=args.out,
        seconds=args.seconds,
        id=args.id,
    )
    report = recorder.run(settings, stop_on_signals())
    if args.json:
        print_json(report)
    else:
        print(f"{report.path}: " + ", ".join(f"{n} {topic}" for topic, n in sorted(report.messages.items())))
        for reason, count in sorted(report.dropped.items()):
            print(f"  not recorded: {count} ({reason})")
    if report.ended:
        raise Failed(report.ended)
    return 1 if report.missing else 0
