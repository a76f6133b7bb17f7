"""The paper's experiment with nobody in it: a network here, its wearer with two sensors on one segment."""

import argparse
import secrets
import threading
from pathlib import Path
from tempfile import TemporaryDirectory

from brachium.commands.emulate import settings_of
from brachium.demo_network import ROOM, DemoNetwork
from brachium.processes import Processes
from brachium.shell import Failed, Usage
from brachium.way_in import TOKEN_VARIABLE
from brachium_nodes.emulate import node_entries
from brachium_nodes.person import NEUTRAL_S, TRANSITION_S
from brachium_viewer.live_comparison import LiveComparison, LiveSettings
from brachium_viewer.live_comparison import run as compare
from brachium_wire import keys
from brachium_wire.bus import Bus

SECONDS = 30.0


def run(args: argparse.Namespace, stop: threading.Event) -> LiveComparison:
    """Start the network, let the wearer exercise for `args.seconds`, and return what both sensors told.

    Raises Usage, Failed, Unrelated or ValueError, each with one line.
    """
    if args.b != f"{args.a}{keys.REFERENCE}":
        raise Usage(f"the emulated wearer's second sensor is {args.a}{keys.REFERENCE}; came {args.b!r}")
    seconds = args.seconds or SECONDS
    with TemporaryDirectory(prefix="brachium-") as folder:
        port = Path(folder) / "shimmer"
        words = ["--subject", args.a, "--exercise", args.exercise, "--segments", args.segment]
        words += ["--level", args.level, "--seed", str(args.seed), "--wifi", "good"]
        words += ["--shimmer", str(port), "--shimmer-delay", str(args.shimmer_delay)]
        token = secrets.token_urlsafe(16)
        node_entries(settings_of(words, token))  # bad input is said before anything starts
        with Processes(environment={TOKEN_VARIABLE: token}) as processes:
            network = DemoNetwork(folder=Path(folder) / "network", processes=processes)
            network.start(settings_of(words, token), view=False)
            with Bus.open(network.endpoint, stop=stop) as bus:
                network.wait_ready(bus, stop)
            if stop.is_set():
                raise Failed("stopped before the network was up")
            shimmer = ["--room", ROOM, "--endpoint", network.endpoint, "--port", str(port)]
            shimmer += ["--subject", args.b, "--segment", args.segment]
            log = network.folder / "logs" / "shimmer.err"
            processes.start("shimmer", ["shimmer", *shimmer], stdout=log, stderr=log)
            network.move(words)
            settings = LiveSettings(
                a=args.a,
                b=args.b,
                endpoint=network.endpoint,
                room=ROOM,
                seconds=NEUTRAL_S + TRANSITION_S + seconds,
            )
            found = compare(settings, stop)
            network.check()
    return found
