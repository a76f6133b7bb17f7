"""Serve the therapist's and the patient's page to browsers: on this machine, or with --bind on one network.

Each screen enters a pairing code once, which is printed here, or the password in $BRACHIUM_WEB_PASSWORD.

brachium web --sessions sessions
  brachium web --bind 192.168.1.20 --port 8080
"""

import argparse
import logging
import os
from pathlib import Path

from brachium.option_types import folder, port_or_any
from brachium.shell import add_network, serve

log = logging.getLogger(__name__)

PASSWORD_VARIABLE = "BRACHIUM_WEB_PASSWORD"
"""Environment variable: a command line would show it to every user of the machine."""


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the options of the pages."""
    add_network(parser)
    parser.add_argument("--bind", default="127.0.0.1", help="address of one interface")
    parser.add_argument("--port", type=port_or_any, default=8080, help="0 takes any free one")
    parser.add_argument("--subject", help="who is shown first (default: the first that is heard of)")
    parser.add_argument(
        "--sessions", type=folder, default=Path("sessions"), metavar="DIR", help="recordings and results"
    )
    parser.add_argument(
        "--no-password",
        action="store_true",
        help="nobody is asked for anything; only on this machine (default: a pairing code is printed, or "
        f"${PASSWORD_VARIABLE} holds the password)",
    )


def run(args: argparse.Namespace) -> int:
    """Start the server."""
    from brachium_nodes.listening import listening_address
    from brachium_viewer.sessions.folder import in_no_session
    from brachium_viewer.sessions.store import Store
    from brachium_viewer.web import server

    bind = listening_address(args.bind)
    with Store.open(args.sessions) as store:  # refused now, and not when a session is to be kept
        loose = in_no_session(args.sessions, {one.recording for one in store.sessions()})
    if loose:
        log.warning(
            "%s recording(s) here are in no history, last %s; to keep one: brachium sessions add %s --dir %s",
            len(loose),
            loose[-1].name,
            loose[-1],
            args.sessions,
        )
    settings = server.WebSettings(
        endpoint=args.endpoint,
        room=args.room,
        bind=bind,
        port=args.port,
        subject=args.subject,
        sessions=args.sessions,
        password=os.environ.get(PASSWORD_VARIABLE) or None,
        open_door=args.no_password,
        on_ready=lambda address: print(f"pages: {address}  (patient: {address}patient)", flush=True),
        on_code=lambda code: print(f"pairing code: {code[:4]}-{code[4:]}", flush=True),
    )
    return serve(lambda stop: server.run(settings, stop))
