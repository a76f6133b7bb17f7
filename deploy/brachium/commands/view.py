"""Show the room live: in a window where there is a display, else as a page on loopback.

brachium view --web
"""

import argparse

from brachium.option_types import port_or_any
from brachium.shell import add_network, serve


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the view's options."""
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

    settings = live.ViewSettings(
        endpoint=args.endpoint,
        room=args.room,
        subject=args.subject,
        web=True if args.web else False if args.window else None,
        web_port=args.web_port,
        grpc_port=args.grpc_port,
        open_browser=args.open,
        on_address=lambda address: print(f"live view: {address}", flush=True),
    )
    return serve(lambda stop: live.run(settings, stop))
