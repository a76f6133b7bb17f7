"""Compare two results, or a result and a reference: errors of A against B.

With --live A and B are subjects of a running network, a person's own nodes and a second set of sensors on the
same segments; with --emulate that network is started here, its wearer emulated.

brachium compare angles.csv truth.parquet --lag estimate
  brachium compare --live p01 p01.ref --seconds 60
  brachium compare --live p01 p01.ref --emulate --seconds 30
"""

import argparse
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

from brachium.option_types import duration_s, real, seed
from brachium.shell import Usage, add_json, add_network, print_json, stop_on_signals


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    parser.add_argument("a", metavar="A", help="a result (.csv or .parquet), as solve writes it")
    parser.add_argument("b", metavar="B", help="another, or a reference, as a truth.parquet")
    parser.add_argument("--lag", help="seconds A is late, or: estimate (default: as B's capture says)")
    parser.add_argument("--mask", metavar="COLUMN", help="of B; only rows count where it is true")
    parser.add_argument("--from", dest="from_s", type=real(), metavar="S", help="only from this time of B on")
    parser.add_argument("--to", dest="to_s", type=real(), metavar="S", help="only up to this time of B")
    parser.add_argument(
        "--frame",
        choices=("none", "rigid", "heading"),
        help="turn (and shift) A onto B first: not at all (default), wholly, or about the vertical",
    )
    parser.add_argument(
        "--repetitions",
        metavar="COLUMN",
        help="what rises once a repetition (default auto: the angle that moves most; none: no cutting)",
    )
    parser.add_argument(
        "--columns", metavar="NAME,..", help="only these, as in elbow_flexion,wrist_* (default: all in both)"
    )
    parser.add_argument(
        "--figure", type=Path, metavar="FILE", help="draw Bland-Altman plots (.svg, .png or .pdf)"
    )
    add_json(parser)
    live = parser.add_argument_group("live")
    live.add_argument("--live", action="store_true", help="A and B are subjects; B's errors against A")
    live.add_argument(
        "--seconds", type=duration_s, metavar="S", help="so long, once both are there (default: till Ctrl-C)"
    )
    live.add_argument(
        "--emulate",
        action="store_true",
        help="start a network here, its wearer with a node and a Shimmer3 on one segment",
    )
    live.add_argument("--exercise", default="elbow-flexion", help="of the emulated wearer")
    live.add_argument("--segment", default="forearm_r", help="that carries both")
    live.add_argument("--level", default="typical", help="of the emulated sensors' errors")
    live.add_argument("--seed", type=seed, default=1, help="of everything random")
    live.add_argument(
        "--shimmer-delay", type=real(0.0, 0.4), default=0.04, metavar="S", help="from its sample to its port"
    )
    add_network(live)


def run(args: argparse.Namespace) -> int:
    """Compare, and tell."""
    if args.live:
        return _live(args)
    if args.emulate or args.seconds is not None:
        raise Usage("--emulate and --seconds go with --live")
    from brachium_viewer import agreement_chart, compare, compare_text

    a, b = Path(args.a), Path(args.b)
    for path in (a, b):
        if not path.exists():
            raise FileNotFoundError(2, "no such file", str(path))
    chosen: dict[str, Any] = {
        name: value
        for name in ("mask", "from_s", "to_s", "frame", "repetitions")
        if (value := getattr(args, name)) is not None
    }
    if args.lag is not None:
        chosen["lag"] = args.lag if args.lag == "estimate" else _seconds(args.lag)
    if args.columns is not None:
        chosen["columns"] = tuple(name.strip() for name in args.columns.split(","))
    found, rows = compare.compare(a, b, replace(compare.settings_beside(b), **chosen))
    if args.json:
        print_json(found)
    else:
        print(compare_text.text(found), end="", flush=True)
    if args.figure is not None:  # whatever becomes of it, the figures are told
        left_out = agreement_chart.draw(args.figure, rows.numbers, rows.counts, found.units)
        if left_out:
            print(
                f"{args.figure}: no room for {len(left_out)} columns ({', '.join(left_out[:3])} ..): "
                "choose with --columns, or write a .pdf, which has pages for all",
                file=sys.stderr,
            )
    return 0


def _seconds(text: str) -> float:
    try:
        return real()(text)
    except argparse.ArgumentTypeError:
        raise Usage(f"--lag takes seconds or the word estimate; came {text!r}") from None


def _live(args: argparse.Namespace) -> int:
    from brachium_viewer import live_comparison, two_sensors_text
    from brachium_wire import keys

    for name in (args.a, args.b):
        keys.subject_chunk(name)
    if args.a == args.b:
        raise Usage(f"{args.a} cannot be compared with itself; a second set of sensors is {args.a}.ref")
    stop = stop_on_signals()
    if args.emulate:
        from brachium import live_experiment

        found = live_experiment.run(args, stop)
    else:
        settings = live_comparison.LiveSettings(
            a=args.a, b=args.b, endpoint=args.endpoint, room=args.room, seconds=args.seconds
        )
        found = live_comparison.run(settings, stop)
    if args.json:
        print_json(found)
    else:
        print(two_sensors_text.text(found), end="")
    return 0
