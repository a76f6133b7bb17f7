"""Serve the therapist's and the patient's page to browsers: on this machine, or with --bind on one network.

Each screen enters a pairing code once, or the password in $BRACHIUM_WEB_PASSWORD.

brachium web --sessions sessions
  brachium web --bind 192.168.1.20 --port 8080
"""

import argparse
import os
from pathlib import Path

from brachium.option_types import port_or_any
from brachium.shell import add_network, serve

PASSWORD_VARIABLE = "BRACHIUM_WEB_PASSWORD"
"""Environment variable: a command line would show it to every user of the machine."""


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the options of the pages."""
    add_network(parser)
    parser.add_argument("--bind", default="127.0.0.1", help="address of one interface")
    parser.add_argument("--port", type=port_or_any, default=8080, help="0 takes any free one")
    parser.add_argument("--subject", help="who is shown first (default: the first that is heard of)")
    parser.add_argument(
        "--sessions", type=Path, default=Path("sessions"), metavar="DIR", help="recordings and results"
    )
    parser.add_argument(
        "--no-password", action="store_true", help="nobody is asked for anything; only on this machine"
    )


def run(args: argparse.Namespace) -> int:
    """Start the server."""
    from brachium_viewer.web import server

    settings = server.WebSettings(
        endpoint=args.endpoint,
        room=args.room,
        bind=args.bind,
        port=args.port,
        subject=args.subject,
        sessions=args.sessions,
        password=os.environ.get(PASSWORD_VARIABLE) or None,
        open_door=args.no_password,
        on_ready=lambda address: print(f"pages: {address}  (patient: {address}patient)", flush=True),
        on_code=lambda code: print(f"pairing code: {code[:4]}-{code[4:]}", flush=True),
    )
    return serve(lambda stop: server.run(settings, stop))
