"""Show the room live, or a recording: in a window where there is a display, else as a page on loopback.

brachium view --web
  brachium view --raw
  brachium view recordings/p01.mcap --at 95
"""

import argparse
from pathlib import Path

from brachium.option_types import port_or_any, real
from brachium.shell import Usage, add_network, serve

RECORDED_MEMORY = "1GB"
"""Of a recording everything is kept: an hour of both arms takes about half of it."""


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the view's options."""
    parser.add_argument("recording", nargs="?", type=Path, metavar="RECORDING", help="instead of the room")
    parser.add_argument(
        "--at",
        type=real(0.0, 1e6),
        metavar="S",
        help="where a recording begins to be shown, s from its start",
    )
    parser.add_argument("--raw", action="store_true", help="what the sensors send, too")
    add_network(parser)
    parser.add_argument("--subject", default="*", help="only this one; * is all")
    where = parser.add_mutually_exclusive_group()
    where.add_argument("--web", action="store_true", help="as a page, even if there is a display")
    where.add_argument("--window", action="store_true", help="in a window, even if no display is found")
    parser.add_argument("--web-port", type=port_or_any, default=9090, help="port of the page")
    parser.add_argument("--grpc-port", type=port_or_any, default=9876, help="port of the stream")
    parser.add_argument("--open", action="store_true", help="open the page in the browser")


def run(args: argparse.Namespace) -> int:
    """Start the live view."""
    from brachium_viewer import live

    if args.recording is None and args.at is not None:
        raise Usage("--at belongs to a recording: name it")

    settings = live.ViewSettings(
        endpoint=args.endpoint,
        room=args.room,
        subject=args.subject,
        web=True if args.web else False if args.window else None,
        web_port=args.web_port,
        grpc_port=args.grpc_port,
        open_browser=args.open,
        raw=args.raw,
        memory_limit=RECORDED_MEMORY if args.recording else live.MEMORY_LIMIT,
        on_address=lambda address: print(f"live view: {address}", flush=True),
    )
    if args.recording is not None:
        from brachium_viewer import recorded_view

        return serve(lambda stop: recorded_view.run(args.recording, args.at or 0.0, settings, stop))
    return serve(lambda stop: live.run(settings, stop))
