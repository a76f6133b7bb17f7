"""Emulate a wearer: its sensors, through the gateway or straight to the bus, and the truth beside them.

brachium emulate --exercise drinking --level typical --seconds 60
  brachium emulate --wearers 20 --seconds 60
  brachium emulate --exercise sensor-calibration --gateway --token-file token.txt --flash flash
  brachium emulate --print-nodes --token-file token.txt >> site.toml
"""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from brachium.option_types import folder, probability, real, seed, whole
from brachium.shell import Usage, add_json, add_network, print_json, stop_on_signals
from brachium.way_in import GATEWAY, add_way_in, node_table, read_token

if TYPE_CHECKING:
    from brachium_nodes.emulate import EmulateSettings


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the wearer's options."""
    add_network(parser)
    add_way_in(parser)
    add_json(parser)
    parser.add_argument("--subject", default="p01", help="the subject's name")
    parser.add_argument("--wearers", type=whole(1, 10_000), default=1, help="more than one: p001, p002, ...")
    parser.add_argument(
        "--different",
        action="store_true",
        help="each of many wearers moves by itself: some twenty a core (default: all move as the first)",
    )
    parser.add_argument(
        "--nodes",
        default="emulated",
        choices=["emulated", "micropython"],
        help=f"micropython: the wearables' own firmware, through a gateway (default: {GATEWAY})",
    )
    parser.add_argument(
        "--shimmer",
        type=Path,
        metavar="PORT",
        help="wear a Shimmer3 beside the first node too; its port will be here",
    )
    parser.add_argument(
        "--shimmer-delay", type=real(0.0, 1.0), default=0.02, metavar="S", help="from a sample to the port"
    )
    parser.add_argument(
        "--flash", type=folder, metavar="DIR", help="where the nodes keep their sensors' calibration"
    )
    add_wearer(parser)
    add_faults(parser)


def add_wearer(parser: argparse.ArgumentParser) -> None:
    """Add who moves, and with which sensors."""
    parser.add_argument(
        "--exercise",
        default="elbow-flexion",
        help="what is done; an unknown name lists all; sensor-calibration: worn by nobody, to be calibrated",
    )
    parser.add_argument("--routine", help="what is done first; an unknown name lists all")
    parser.add_argument(
        "--stand",
        type=real(),
        metavar="S",
        help="stand still for so long before all that: more than the 4 s there are, to be calibrated by hand",
    )
    parser.add_argument("--arms", default="right", help="right, left or both")
    parser.add_argument(
        "--level", default="typical", help="sensor errors: exact (none), ideal, typical or patient"
    )
    parser.add_argument("--seed", type=seed, default=1, help="of everything random")
    parser.add_argument("--rate", type=real(1.0, 1000.0), default=100.0, metavar="HZ", help="of the sensors")
    parser.add_argument("--batch", type=whole(1, 128), default=5, help="samples in a packet")
    parser.add_argument("--segments", metavar="A,B", help="which carry a sensor (default: the arm's three)")


def add_faults(parser: argparse.ArgumentParser) -> None:
    """Add what goes wrong on the way."""
    parser.add_argument("--loss", type=probability, default=0.0, help="probability that a packet is lost")
    parser.add_argument("--swap", type=probability, default=0.0, help="that it comes after its successor")
    parser.add_argument("--duplicate", type=probability, default=0.0, help="that it comes twice")
    parser.add_argument("--wifi", default="none", help="delays: none, good or busy")


def run(args: argparse.Namespace) -> int:
    """Emulate, then tell what was sent."""
    from brachium_nodes import emulate, emulate_bench

    chosen = settings(args, read_token(args))
    if args.print_nodes:
        print(node_table(emulate.node_entries(chosen)))
        return 0
    mistake = emulate_bench.EXERCISES.get(args.exercise)
    if mistake is None:
        report = emulate.run(chosen, stop_on_signals())
    else:
        report = emulate_bench.run(chosen, mistake, stop_on_signals())
    if args.json:
        print_json(report)
        return 0
    for subject, streams in report.streams.items():
        for segment, count in streams.items():
            print(f"{subject} {segment}: {count.sent} sent, {count.lost} lost, {count.swapped} out of order")
    return 0


def settings(args: argparse.Namespace, token: str) -> "EmulateSettings":
    """Return what the options ask for; raises ValueError for what cannot be emulated."""
    from brachium_nodes.emulate import EmulateSettings
    from brachium_nodes.emulate_bench import EXERCISES
    from brachium_nodes.exercises import EXERCISES as WORN
    from brachium_nodes.link import FaultSettings
    from brachium_nodes.person import NEUTRAL_S
    from brachium_nodes.shimmer.emulated_port import ShimmerTwin
    from brachium_nodes.wearer import WearerSettings

    if args.exercise not in (*WORN, *EXERCISES):
        known = ", ".join((*WORN, *EXERCISES))
        raise Usage(f"exercise {args.exercise!r} is not known; choose one of {known}")
    return EmulateSettings(
        endpoint=args.endpoint,
        room=args.room,
        gateway=args.gateway or GATEWAY,
        token=token,
        firmware=args.nodes == "micropython",
        direct=args.gateway is None and not args.print_nodes and args.nodes == "emulated",
        speed=args.speed,
        seconds=args.seconds,
        subject=args.subject,
        wearers=args.wearers,
        alike=not args.different,
        shimmer=None if args.shimmer is None else ShimmerTwin(path=args.shimmer, delay_s=args.shimmer_delay),
        flash=args.flash,
        wearer=WearerSettings(
            exercise="elbow-flexion" if args.exercise in EXERCISES else args.exercise,
            routine=args.routine or "",
            stand_s=NEUTRAL_S if args.stand is None else args.stand,
            arms=args.arms,
            level=args.level,
            seed=args.seed,
            rate_hz=args.rate,
            batch=args.batch,
            segments=tuple(args.segments.split(",")) if args.segments else (),
        ),
        faults=FaultSettings(loss=args.loss, swap=args.swap, duplicate=args.duplicate, wifi=args.wifi),
    )


def settings_of(words: list[str], token: str) -> "EmulateSettings":
    """Return what a command line of this command asks for."""
    parser = argparse.ArgumentParser()
    configure(parser)
    return settings(parser.parse_args(words), token)
