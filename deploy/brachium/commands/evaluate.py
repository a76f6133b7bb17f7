"""The accuracy tables: both papers' experiments on emulated wearers, and real recordings.

brachium evaluate --data ../shared/data --table broad --table arm
"""

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING, get_args

from brachium.option_types import whole
from brachium.shell import Usage, add_json, as_json

if TYPE_CHECKING:
    from brachium.evaluation.tables import Table


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    parser.add_argument("--data", type=Path, metavar="DIR", help="captures with or without a truth")
    parser.add_argument("--level", nargs="+", default=["ideal", "typical"], metavar="LEVEL",
                        help="of the emulated wearers: exact, ideal, typical, patient")  # fmt: skip
    parser.add_argument(
        "--seeds", type=whole(1, 100), default=3, metavar="N", help="figures are their median"
    )
    parser.add_argument("--table", action="append", default=[], metavar="NAME", help="only this one; repeat")
    parser.add_argument("--list", action="store_true", help="list the tables, and end")
    parser.add_argument("--quick", action="store_true", help="one seed, shorter: a look, not a figure")
    parser.add_argument("--gate", action="store_true", help="the few figures that a test holds, as JSON")
    parser.add_argument("--markdown", action="store_true", help="print sections of a page")
    parser.add_argument("--out", type=Path, metavar="FILE", help="write what is printed there, too")
    add_json(parser)


def run(args: argparse.Namespace) -> int:
    """Make the tables, and print them."""
    from brachium.evaluation.catalogue import find
    from brachium.evaluation.context import Context
    from brachium_nodes.sensors import Level

    for level in args.level:
        if level not in get_args(Level):
            raise Usage(f"--level {level!r} is not known; choose of {', '.join(get_args(Level))}")
    if args.data is not None and not args.data.is_dir():
        raise Usage(f"--data {args.data}: no such folder")
    entries = find(args.table)
    if args.list:
        print("\n".join(f"{entry.name:<22}{entry.shows}" for entry in entries))
        return 0
    if args.gate:
        from brachium.evaluation.gate import figures

        _give(as_json(figures()), args.out)
        return 0
    context = Context(
        levels=tuple(args.level),
        seeds=tuple(range(1, 2 if args.quick else args.seeds + 1)),
        data=args.data,
        quick=args.quick,
        progress=lambda text: print(text, file=sys.stderr, flush=True),
    )
    made: list[Table] = []
    for entry in entries:
        if entry.needs_data and context.data is None:
            context.progress(f"{entry.name}: left out, it needs recordings (give --data)")
            continue
        made += entry.make(context)
    _give(said(made, context.seeds, as_json_text=args.json, markdown=args.markdown), args.out)
    return 0


def _give(text: str, out: Path | None) -> None:
    if out is not None:
        out.write_text(text + "\n", encoding="utf-8")
    print(text)


def said(made: "list[Table]", seeds: tuple[int, ...], *, as_json_text: bool, markdown: bool) -> str:
    """Return the tables as JSON, as sections of a page, or for a terminal."""
    if as_json_text:
        return as_json({"seeds": list(seeds), "tables": {table.name: table.plain() for table in made}})
    if markdown:
        return "\n\n".join(table.markdown() for table in made)
    return "\n\n\n".join(table.text() for table in made)
