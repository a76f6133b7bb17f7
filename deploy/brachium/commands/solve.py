"""Turn a recording or a capture folder into a table of angles, positions and orientations.

brachium solve recording.mcap --out angles.csv
  brachium solve recording.mcap --settings arm.c3d --out again.csv
"""

import argparse
import math
import os
from pathlib import Path
from typing import TYPE_CHECKING

from brachium.option_types import real
from brachium.output_file import spare
from brachium.shell import Usage, add_json, print_json

if TYPE_CHECKING:
    from brachium_fusion.result import Group
    from brachium_fusion.solve import SolveReport


SAME_RAD = 1e-6
"""Live and solved are the same sums; apart by more, they did not have the same samples."""


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    parser.add_argument("input", type=_given, metavar="INPUT", help="a recording (.mcap) or a capture folder")
    parser.add_argument(
        "--out", type=Path, metavar="FILE", help=".csv or .parquet; without it only the figures"
    )
    parser.add_argument("--subject", help="which subject of a recording; needed where there are several")
    parser.add_argument(
        "--filter",
        help="auto, vqf, complementary, complementary-printed, zhou or zhou-printed (default: as live)",
    )
    parser.add_argument(
        "--mode",
        choices=("live", "best"),
        help="live (default): what the live service would give; best: from the whole recording",
    )
    parser.add_argument("--no-mag", action="store_true", help="leave magnetometers aside")
    parser.add_argument(
        "--rate", type=real(1.0, 1000.0), metavar="HZ", help="instants a second (default: as the input)"
    )
    parser.add_argument("--columns", metavar="GROUP,..", help="groups of columns, as in clinical,positions")
    parser.add_argument(
        "--settings",
        type=Path,
        metavar="FILE",
        help="as the numbers in this result or exported file were solved; other options come first",
    )
    add_json(parser)


def run(args: argparse.Namespace) -> int:
    """Solve, and tell what was found."""
    from brachium_fusion import solve
    from brachium_fusion.orientation import FILTERS
    from brachium_fusion.result import GROUPS
    from brachium_fusion.zhou_recording import ZHOU

    if args.settings is not None:
        _as_before(args)
    if args.filter is not None and args.filter not in (*FILTERS, *ZHOU):
        known = ", ".join((*FILTERS, *ZHOU))
        raise Usage(f"--filter {args.filter!r} is not known; choose one of {known}")
    if args.out is not None:
        _check_writable(args.out)
        spare(args.input, args.out)
    report = solve.run(
        solve.SolveSettings(
            input=args.input,
            out=args.out,
            subject=args.subject,
            filter=args.filter,
            magnetometer=not args.no_mag,
            rate_hz=args.rate,
            mode=args.mode or "live",
            groups=_groups(args.columns, GROUPS),
        )
    )
    if args.json:
        print_json(figures(report))
    else:
        print(_words(args.input, report))
    return 0


def _as_before(args: argparse.Namespace) -> None:
    """Take from the file of --settings what no other option says."""
    from brachium_viewer.export.about import settings

    said = settings(args.settings)
    args.filter = args.filter or said.get("filter")
    args.mode = args.mode or said.get("mode")
    args.rate = args.rate or said.get("rate_hz")
    args.no_mag = args.no_mag or said.get("magnetometer") is False
    if args.columns is None and isinstance(said.get("columns"), list):
        args.columns = ",".join(said["columns"])
    if not args.input.is_dir():
        args.subject = args.subject or said.get("subject")


def figures(report: "SolveReport") -> dict[str, object]:
    """Return the report without the skeletons themselves; what JSON cannot say, infinity, is None."""
    found = {name: getattr(report, name) for name in report.__slots__ if name != "skeletons"}
    return {n: None if isinstance(x, float) and not math.isfinite(x) else x for n, x in found.items()}


def _given(text: str) -> Path:
    if not text.strip():
        raise argparse.ArgumentTypeError("give a recording or a capture folder")
    return Path(text)


def _check_writable(out: Path) -> None:
    """Refuse, before minutes of solving, what could not be written after them."""
    if out.suffix not in (".csv", ".parquet"):
        raise Usage(f"--out {out}: a table's name ends in .csv or .parquet")
    if not out.parent.is_dir():
        raise Usage(f"--out {out}: there is no folder {out.parent}; make it first")
    if out.is_dir() or not os.access(out if out.exists() else out.parent, os.W_OK):
        raise Usage(f"--out {out}: cannot be written in folder {out.parent}; choose another")


def _groups(text: str | None, known: "tuple[Group, ...]") -> "tuple[Group, ...]":
    if text is None:
        return known
    wanted = [word.strip() for word in text.split(",")]
    for word in wanted:
        if word not in known:
            raise Usage(f"--columns {word!r} is not known; choose of {', '.join(known)}")
    return tuple(group for group in known if group in wanted)


def _words(source: Path, report: "SolveReport") -> str:
    lines = [
        f"{source}: {report.rows} instants, {' and '.join(report.sides)}, "
        + (f"filter {report.filter}" if report.mode == "live" else "best of the whole recording"),
        f"forward: {report.forward}",
    ]
    for segment, counts in report.quality.items():
        lines.append(f"  {segment}: " + ", ".join(f"{n} {quality}" for quality, n in counts.items()))
    for why in dict.fromkeys(report.assumptions.values()):
        names = [what.replace("_", " ") for what, text in report.assumptions.items() if text == why]
        lines.append(f"assumed, not measured: {', '.join(names)}: {why}")
    if report.live_compared:
        lines.append(f"beside {report.live_compared} live skeletons: {_beside_live(report)}")
    lines += [f"not used: {count} ({reason})" for reason, count in report.drops.items()]
    lines += [f"{part.replace('_', ' ')}: {words}" for part, words in report.parts.items()]
    lines += [f"refused, {what.replace('_', ' ')}: {reason}" for what, reason in report.refused.items()]
    lines += [f"warning: {warning}" for warning in report.warnings]
    if report.out is not None:
        lines.append(f"wrote {report.out}")
    return "\n".join(lines)


def _beside_live(report: "SolveReport") -> str:
    angle, position = report.live_angle_rad, report.live_position_m
    if angle is None or position is None or not angle <= SAME_RAD:
        apart = (
            f" (up to {math.degrees(angle):.2g} deg)" if angle is not None and math.isfinite(angle) else ""
        )
        return f"differs from what was live{apart}: the recording is damaged, or fusion restarted during it"
    return f"at most {angle:.1e} rad and {position:.1e} m apart"
