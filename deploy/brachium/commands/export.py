"""Turn a recording, a result or a capture folder into a file that other tools open.

brachium export recording.mcap --to c3d --out arm.c3d
  brachium export angles.csv --out arm.bvh --from 10 --until 25
  brachium export recording.mcap --to motion-bids --out study --session 1 --task reaching
"""

import argparse
import os
from pathlib import Path

from brachium.option_types import real
from brachium.output_file import spare
from brachium.shell import Usage, add_json, print_json

FORMATS = ("csv", "parquet", "sto", "mot", "trc", "c3d", "bvh", "rrd", "motion-bids")
LATEST_S = 1e10
"""Recordings may hold parts years apart, by clocks that were set."""
WHERE = {
    "sto": "OpenSim (OpenSense): orientations of torso, humerus, radius, hand",
    "mot": "OpenSim: joint angles",
    "trc": "OpenSim: joint centres as markers",
    "c3d": "Mokka and gait laboratories' tools",
    "bvh": "Blender and other animation programs",
    "rrd": "Rerun, of this version alone: to look at, not to keep",
    "motion-bids": "a study's folder: each call adds a recording",
}


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    parser.add_argument(
        "input",
        type=Path,
        metavar="INPUT",
        help="a recording (.mcap), a result (.csv, .parquet) or a capture",
    )
    shown = "; ".join(f"{name}: {text}" for name, text in WHERE.items())
    parser.add_argument("--to", choices=FORMATS, help=f"by --out's ending where it is left out. {shown}")
    parser.add_argument("--out", type=Path, required=True, metavar="FILE", help="the file, or study's folder")
    parser.add_argument("--subject", help="which subject of a recording; needed where there are several")
    parser.add_argument(
        "--columns", metavar="NAME,..", help="groups (as in solve), columns or patterns: clinical,elbow_*"
    )
    parser.add_argument("--rate", type=real(0.1, 2000.0), metavar="HZ", help="instants a second")
    parser.add_argument(
        "--from",
        dest="from_s",
        type=real(0.0, LATEST_S),
        metavar="S",
        help="from the motion's first instant",
    )
    parser.add_argument("--until", dest="until_s", type=real(0.0, LATEST_S), metavar="S", help="likewise")
    parser.add_argument(
        "--measured", action="store_true", help="leave out what is held, assumed or uncalibrated"
    )
    parser.add_argument("--session", metavar="NAME", help="of motion-bids: the session, as in 1")
    parser.add_argument("--task", metavar="NAME", help="of motion-bids: what was done")
    add_json(parser)


def run(args: argparse.Namespace) -> int:
    """Export, and name the files."""
    from brachium.export_source import table_of
    from brachium.version import version
    from brachium_viewer.export import formats

    wish = formats.Wish(
        to=_format(args.to, args.out),
        columns=tuple(word.strip() for word in args.columns.split(",")) if args.columns else (),
        rate_hz=args.rate,
        from_s=args.from_s,
        until_s=args.until_s,
        measured=args.measured,
        session=args.session,
        task=args.task,
    )
    if not args.out.parent.is_dir() or not os.access(args.out.parent, os.W_OK):
        raise Usage(
            f"--out {args.out}: cannot be written in folder {args.out.parent}; make it or choose another"
        )
    if args.out.is_dir() != (wish.to == "motion-bids") and args.out.exists():
        raise Usage(f"--out {args.out}: --to {wish.to} writes a {'folder' if args.out.is_file() else 'file'}")
    spare(args.input, args.out)
    files = formats.export(table_of(args.input, args.subject), args.out, wish, f"{version()}, export")
    if args.json:
        print_json({"files": [str(path) for path in files]})
    else:
        print("\n".join(f"wrote {path}" for path in files))
    return 0


def _format(to: str | None, out: Path) -> str:
    name = to or out.suffix.removeprefix(".")
    if name not in FORMATS:
        raise Usage(f"--out {out}: no format goes by this ending; choose one with --to: {', '.join(FORMATS)}")
    if name != "motion-bids" and out.suffix != f".{name}":
        raise Usage(f"--out {out}: a file of --to {name} ends in .{name}")
    return name
