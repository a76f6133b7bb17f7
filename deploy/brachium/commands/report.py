"""A session's report: one page of HTML that prints to A4, and a table of its repetitions.

brachium report p01.mcap --out p01.html --csv p01.csv --sessions recordings
"""

import argparse
import logging
import os
from pathlib import Path

from brachium.shell import Usage, add_json, count, print_json

_log = logging.getLogger(__name__)


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    parser.add_argument("recording", type=Path, metavar="RECORDING", help="as brachium record writes it")
    parser.add_argument("--out", type=Path, required=True, metavar="FILE", help="the page, .html")
    parser.add_argument(
        "--csv",
        type=Path,
        metavar="FILE",
        help="one row a repetition, .csv or .parquet; beside it, .sets.csv, what is said of sets",
    )
    parser.add_argument(
        "--sessions", type=Path, metavar="DIR", help="earlier sessions, to stand beside this one"
    )
    parser.add_argument("--subject", help="which subject of the recording; needed where there are several")
    parser.add_argument("--exercise", help="what was done, in a recording without marks")
    parser.add_argument("--language", default="en", metavar="CODE", help="of the page: en (default) or de")
    parser.add_argument("--side", choices=("right", "left"), help="by which arm, in one without marks")
    add_json(parser)


NOTHING = "the report is empty: no exercise was marked or is named that it knows; give --exercise and --side"


def run(args: argparse.Namespace) -> int:
    """Write the page, and say what it holds."""
    from brachium_viewer.catalogue import LANGUAGES
    from brachium_viewer.exercises import EXERCISES
    from brachium_viewer.marks import ExerciseBegins
    from brachium_viewer.report import page
    from brachium_viewer.report.tidy_sets import beside

    if (args.exercise is None) != (args.side is None):
        raise Usage("--exercise and --side go together")
    if args.exercise is not None and args.exercise not in EXERCISES:
        raise Usage(f"--exercise {args.exercise!r} is not known; choose of {', '.join(EXERCISES)}")
    if args.language not in LANGUAGES:
        raise Usage(f"--language {args.language!r} is not there; choose of {', '.join(LANGUAGES)}")
    check_writable(args.out, (".html",), "--out")
    if args.csv is not None:
        check_writable(args.csv, (".csv", ".parquet"), "--csv")
    if args.sessions is not None and not args.sessions.is_dir():
        raise Usage(f"--sessions {args.sessions}: there is no such folder")
    begins = None if args.exercise is None else ExerciseBegins(exercise=args.exercise, side=args.side)
    found = page.write(
        page.ReportSettings(
            recording=args.recording,
            out=args.out,
            csv=args.csv,
            sessions=args.sessions,
            subject=args.subject,
            without_marks=begins,
            language=args.language,
        )
    )
    if not found.sets and begins is None:
        _log.warning("%s: %s", args.recording, NOTHING)
    if found.clock:
        _log.warning("%s: %s", args.recording, found.clock)
    if args.json:
        print_json(found)
        return 0
    said = "" if found.origin == "worn" else f" ({found.origin})"
    held = f"{count(found.sets, 'set')}, {count(found.repetitions, 'repetition')}"
    print(f"{args.out}: {found.subject}{said}, {held}")
    if args.csv is not None:
        print(f"{args.csv}: one row a repetition")
        print(f"{beside(args.csv)}: one row a number of the sets")
    return 0


def check_writable(path: Path, endings: tuple[str, ...], option: str) -> None:
    """Refuse a file that could not be written, before anything is read."""
    if path.suffix not in endings:
        raise Usage(f"{option} {path}: its name ends in {' or '.join(endings)}")
    if not path.parent.is_dir():
        raise Usage(f"{option} {path}: there is no folder {path.parent}; make it first")
    if path.is_dir() or not os.access(path if path.exists() else path.parent, os.W_OK):
        raise Usage(f"{option} {path}: cannot be written; choose another")
