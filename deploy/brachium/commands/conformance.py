"""Try a node from outside against every rule of docs/node-protocol.md; docs/node-conformance.md explains it.

brachium conformance --id esp-3f21 -- ./my_node {host} {port} {id} {token}
"""

import argparse
import secrets
import signal
from pathlib import Path

from brachium.option_types import port
from brachium.shell import Usage, add_json, print_json


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    parser.add_argument(
        "command", nargs="+", metavar="-- COMMAND", help="what starts one node, and its words"
    )
    parser.add_argument("--id", default="trial", help="the node's id")
    parser.add_argument("--token", help="the node's token (default: a random one)")
    parser.add_argument("--seek-port", type=port, help="it finds its gateway by itself, asking at this port")
    parser.add_argument("--quick", action="store_true", help="for a node whose pauses are short")
    parser.add_argument("--log", type=Path, metavar="FILE", help="keep what the node says on its output")
    add_json(parser)


def run(args: argparse.Namespace) -> int:
    """Try it; 1 when a rule is broken."""
    from brachium_nodes.conformance.suite import judge
    from brachium_nodes.conformance.trial import QUICK, Patience, Trial

    if not args.command[0].strip():
        raise Usage("give the command that starts a node after --, as in -- ./my_node {host} {port}")
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # ends what was started, as Ctrl-C does
    trial = Trial(
        command=tuple(args.command),
        node=args.id,
        token=args.token or secrets.token_hex(16),
        patience=QUICK if args.quick else Patience(),
        log=args.log,
    )
    verdicts = judge(trial, args.seek_port)
    broken = [verdict for verdict in verdicts if verdict.outcome == "failed"]
    if args.json:
        print_json({"rules": verdicts, "failed": len(broken)})
    else:
        for verdict in verdicts:
            print(f"{verdict.rule:<22}{verdict.outcome:<13}{verdict.says}")
        kept = sum(verdict.outcome == "ok" for verdict in verdicts)
        others = len(verdicts) - kept - len(broken)
        print(f"{kept} rules kept, {others} not claimed, {len(broken)} broken")
    return 1 if broken else 0
