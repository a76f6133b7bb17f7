"""Run the room's router.

brachium router --port 7447
"""

import argparse

from brachium.option_types import port, whole
from brachium.shell import add_room, serve


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the router's options."""
    add_room(parser)
    parser.add_argument("--bind", default="127.0.0.1", help="address of one interface")
    parser.add_argument("--port", type=port, default=7447, help="to listen on")
    parser.add_argument("--max-sessions", type=whole(1, 65535), default=256, help="programs at once")
    parser.add_argument("--users", metavar="FILE", help="file of lines user:password; only these may attach")
    parser.add_argument(
        "--print-config",
        action="store_true",
        help="print the JSON5 instead; a zenohd of the same version takes it",
    )


def run(args: argparse.Namespace) -> int:
    """Start the router, or print what it would be told."""
    from brachium_router.config import RouterSettings, router_json5

    settings = RouterSettings(
        bind=args.bind, port=args.port, room=args.room, max_sessions=args.max_sessions, users_file=args.users
    )
    if args.print_config:
        print(router_json5(settings))
        return 0
    from brachium_router import service

    return serve(lambda stop: service.run(settings, stop))
