"""Run the door for wearables, or assign a wearable to a segment of a subject while it runs.

brachium gateway --site lan.toml
  brachium gateway --assign esp-3f21=p01/forearm_r
"""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from brachium.option_types import folder, port_or_any, sha256
from brachium.shell import Failed, Usage, add_network, serve

if TYPE_CHECKING:
    from brachium_nodes.roster import NodeEntry


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the gateway's options."""
    add_network(parser)
    parser.add_argument("--id", default="gateway", help="names the service and its clock")
    parser.add_argument("--bind", default="127.0.0.1", help="address of one interface")
    parser.add_argument("--port", type=port_or_any, default=8765, help="0 takes any free one")
    parser.add_argument(
        "--discovery-port",
        type=port_or_any,
        default=8766,
        help="UDP: nodes that do not know this address find it here; 0: they do not",
    )
    parser.add_argument("--site", type=Path, metavar="FILE.toml", help="the nodes of this site file may join")
    parser.add_argument(
        "--join-token-sha256",
        type=sha256,
        metavar="HEX",
        help="nodes with this token may knock and wait to be assigned",
    )
    parser.add_argument(
        "--calibrations",
        type=folder,
        metavar="DIR",
        help="sensor calibrations that brachium sensor kept, for nodes that bring none",
    )
    parser.add_argument(
        "--assign",
        metavar="ID=SUBJECT/SEGMENT",
        help="tell the running gateway whom a node belongs to, and end",
    )


def run(args: argparse.Namespace) -> int:
    """Start the gateway, or assign."""
    if args.assign is not None:
        _assign(args)
        return 0
    from brachium_nodes import gateway

    settings = gateway.GatewaySettings(
        endpoint=args.endpoint,
        room=args.room,
        id=args.id,
        bind=args.bind,
        port=args.port,
        discovery_port=args.discovery_port or None,
        nodes=_entries(args.site),
        join_token_sha256=args.join_token_sha256,
        calibrations=args.calibrations,
    )
    return serve(lambda stop: gateway.run(settings, stop))


def _entries(site: Path | None) -> "tuple[NodeEntry, ...]":
    if site is None:
        return ()
    from brachium import site_file
    from brachium_nodes.roster import NodeEntry

    return tuple(
        NodeEntry(
            id=node.id,
            token_sha256=node.token_sha256,
            subject=node.subject,
            segment=node.segment,
            mounting=node.mounting,
        )
        for node in site_file.read(site_file.find(str(site))).node
    )


def _assign(args: argparse.Namespace) -> None:
    from brachium_body.segments import SEGMENTS
    from brachium_wire import keys
    from brachium_wire.bus import Bus
    from brachium_wire.codec import decode, encode
    from brachium_wire.messages import Answer, Command

    node, _, place = args.assign.partition("=")
    subject, _, segment = place.partition("/")
    if not (node and subject and segment):
        raise Usage(f"--assign takes ID=SUBJECT/SEGMENT, as in esp-3f21=p01/forearm_r; came {args.assign!r}")
    if segment not in SEGMENTS:
        raise Usage(f"segment {segment!r} is not known; choose one of {', '.join(SEGMENTS)}")
    keys.subject_chunk(subject)
    keys.chunk(node, "node id")
    with Bus.open(args.endpoint) as bus:
        question = encode(Command(arguments={"id": node, "segment": segment}))
        reply = bus.ask(keys.command(args.room, subject, "assign"), question)
    if reply is None:
        raise Failed(
            f"nobody in room {args.room} answered for {node}: is its door running? "
            "brachium gateway, or for trackers brachium slimevr"
        )
    answer = decode(reply, Answer)
    if not answer.ok:
        raise Failed(answer.reason)
    print(f"{node} is now {segment} of {subject}")
