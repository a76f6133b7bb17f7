"""Compile the wearables' firmware into the files that are flashed, or run it here against a network.

brachium firmware --out flash
  brachium firmware --run faults --seconds 60
"""

import argparse
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from brachium.option_types import duration_s
from brachium.shell import Usage, add_json, print_json, stop_on_signals


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    parser.add_argument("--out", type=Path, metavar="DIR", help="write the files for the chip here")
    parser.add_argument(
        "--run", choices=["quiet", "faults"], help="run it on this host, and count every sample"
    )
    parser.add_argument("--seconds", type=duration_s, default=60.0, help="how long to run")
    parser.add_argument("--folder", type=Path, metavar="DIR", help="keep the run's logs here")
    add_json(parser)


def run(args: argparse.Namespace) -> int:
    """Compile, or run."""
    if (args.out is None) == (args.run is None):
        raise Usage("give --out DIR for the files to flash, or --run quiet or faults")
    if args.out is not None:
        from brachium_nodes.firmware_build import flash_files

        for path in flash_files(args.out):
            print(path)
        return 0
    if args.folder is not None:
        return _measure(args, args.folder)
    with TemporaryDirectory() as folder:
        return _measure(args, Path(folder))


def _measure(args: argparse.Namespace, folder: Path) -> int:
    from brachium.firmware_run import FirmwareRun
    from brachium.processes import Processes

    with Processes() as processes:
        run = FirmwareRun(
            folder=folder, seconds=args.seconds, faults=args.run == "faults", processes=processes
        )
        figures = run.run(stop_on_signals())
    if args.json:
        print_json(figures)
        return 0
    print("; ".join(figures.events) or "nothing went wrong", file=sys.stderr)
    for segment, found in figures.samples.items():
        print(
            f"{segment}: {found.taken} taken, {found.received} received, {found.lost} lost, "
            f"{found.late} late, {found.unexplained} unexplained, rate off by {found.rate_off_percent:.3f} %"
        )
    print(f"memory: {figures.heap_peak_k:.1f} of 36 K at most; {figures.skeletons} skeletons")
    return 0
