"""Compare two results, or a result and a reference: errors of A against B.

brachium compare angles.csv truth.parquet --lag estimate
"""

import argparse
from dataclasses import replace
from pathlib import Path
from typing import Any

from brachium.option_types import real
from brachium.shell import Usage, add_json, print_json


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    parser.add_argument("a", type=Path, metavar="A", help="a result (.csv or .parquet), as solve writes it")
    parser.add_argument("b", type=Path, metavar="B", help="another, or a reference, as a truth.parquet")
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
        "--figure", type=Path, metavar="FILE", help="draw Bland-Altman plots (.svg, .png or .pdf)"
    )
    add_json(parser)


def run(args: argparse.Namespace) -> int:
    """Compare, and tell."""
    from brachium_viewer import compare, compare_text

    for path in (args.a, args.b):
        if not path.exists():
            raise FileNotFoundError(2, "no such file", str(path))
    chosen: dict[str, Any] = {
        name: value
        for name in ("mask", "from_s", "to_s", "frame", "repetitions")
        if (value := getattr(args, name)) is not None
    }
    if args.lag is not None:
        chosen["lag"] = args.lag if args.lag == "estimate" else _seconds(args.lag)
    found = compare.compare(
        args.a, args.b, replace(compare.settings_beside(args.b), **chosen), figure=args.figure
    )
    if args.json:
        print_json(found)
    else:
        print(compare_text.text(found), end="")
    return 0


def _seconds(text: str) -> float:
    try:
        return real()(text)
    except argparse.ArgumentTypeError:
        raise Usage(f"--lag takes seconds or the word estimate; came {text!r}") from None
