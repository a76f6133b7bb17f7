"""How what stands for wearables comes in: through a gateway with a token, or straight to the bus."""

import argparse
import os
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

from brachium.option_types import duration_s, real
from brachium.shell import Usage

if TYPE_CHECKING:
    from brachium_nodes.roster import NodeEntry

GATEWAY = "ws://127.0.0.1:8765/node"
TOKEN_VARIABLE = "BRACHIUM_TOKEN"


def add_way_in(parser: argparse.ArgumentParser) -> None:
    """Add --gateway and the options that go with it."""
    parser.add_argument(
        "--gateway",
        nargs="?",
        const=GATEWAY,
        metavar="URL",
        help=f"through it, at {GATEWAY} or URL (default: direct)",
    )
    parser.add_argument(
        "--token-file", type=Path, metavar="FILE", help=f"the nodes' token (or ${TOKEN_VARIABLE})"
    )
    parser.add_argument(
        "--speed", type=real(0.001, 1000.0), default=1.0, help="times real time; not through a gateway"
    )
    parser.add_argument("--seconds", type=duration_s, help="how long (default: to the end, or Ctrl-C)")
    parser.add_argument("--print-nodes", action="store_true", help="print the nodes for a site file, and end")


def read_token(args: argparse.Namespace) -> str:
    """Return the nodes' token; empty where none is needed. Raises Usage where one is and none is given."""
    if args.token_file is not None:
        return str(args.token_file.read_text("utf-8")).strip()
    token = os.environ.get(TOKEN_VARIABLE, "")
    if not token and (args.gateway or args.print_nodes):
        raise Usage(f"a gateway asks for a token: give --token-file or ${TOKEN_VARIABLE}")
    return token


def node_table(entries: "Iterable[NodeEntry]") -> str:
    """Return the part of a site file that lets these nodes in."""
    lines = []
    for entry in entries:
        lines += ["[[node]]", f'id = "{entry.id}"', f'token_sha256 = "{entry.token_sha256}"']
        lines += [f'subject = "{entry.subject}"', f'segment = "{entry.segment}"']
        if entry.mounting is not None:
            lines.append(f"mounting = {[float(part) for part in entry.mounting]}")
        lines.append("")
    return "\n".join(lines)
