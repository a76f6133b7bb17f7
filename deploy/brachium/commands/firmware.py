"""Compile the wearables' firmware into the files that are flashed, configure a node, or run it all here.

brachium firmware --out flash
  brachium firmware --configure brachium.json --serial /dev/ttyUSB0
  brachium firmware --run faults --rate 100 --seconds 60
  brachium firmware --runtime
"""

import argparse
import sys
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory

from brachium.option_types import duration_s, folder
from brachium.shell import Failed, Usage, add_json, print_json, stop_on_signals


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    what = parser.add_mutually_exclusive_group(required=True)
    what.add_argument("--out", type=folder, metavar="DIR", help="write the files for the chip here")
    what.add_argument(
        "--run", choices=["quiet", "faults"], help="run it on this host, and count every sample"
    )
    what.add_argument(
        "--configure", type=Path, metavar="FILE", help="give a node this brachium.json over its serial line"
    )
    what.add_argument("--runtime", action="store_true", help="how long a node runs on its cell")
    what.add_argument(
        "--discharge", action="store_true", help="empty emulated cells: does the warning come in time?"
    )
    parser.add_argument("--serial", metavar="PORT", help="where that node is, as in /dev/ttyUSB0")
    parser.add_argument("--rate", type=int, choices=[50, 100], default=50, help="samples a second of --run")
    parser.add_argument("--seconds", type=duration_s, default=60.0, help="how long to run")
    parser.add_argument("--folder", type=folder, metavar="DIR", help="keep the run's logs here")
    add_json(parser)


def run(args: argparse.Namespace) -> int:
    """Compile, or run."""
    if args.out is not None:
        from brachium_nodes.firmware_build import flash_files

        for path in flash_files(args.out):
            print(path)
        return 0
    if args.configure is not None:
        return _configure_node(args)
    if args.runtime:
        return _run_times(args)
    if args.folder is not None:
        return _measure(args, args.folder.resolve())  # the boards run in folders of their own
    with TemporaryDirectory() as folder:
        return _measure(args, Path(folder))


def _measure(args: argparse.Namespace, folder: Path) -> int:
    return _discharge(args, folder) if args.discharge else _run(args, folder)


def _configure_node(args: argparse.Namespace) -> int:
    from brachium_nodes.serial_setup import TIMEOUT_S, NotTold, open_serial, read_configuration, tell

    if args.serial is None:
        raise Usage("--configure needs --serial PORT, as in /dev/ttyUSB0")
    try:
        configuration = read_configuration(args.configure)
    except NotTold as error:
        raise Usage(str(error)) from None
    try:
        line = open_serial(args.serial)
        print(f"waiting up to {TIMEOUT_S:.0f} s for the node at {args.serial}", file=sys.stderr, flush=True)
        tell(line, configuration)
    except NotTold as error:
        raise Failed(str(error)) from None
    print(f"the node at {args.serial} starts anew with {args.configure}")
    return 0


def _run_times(args: argparse.Namespace) -> int:
    from brachium_nodes.run_time import run_times

    found = run_times()
    if args.json:
        print_json({"run_times": found})
        return 0
    for one in found:
        print(
            f"{one.parts}, {one.rate_hz:g} Hz: {one.total_ma:.0f} mA "
            f"(listening {one.listening_ma:g}, sending {one.sending_ma:g}, computing {one.computing_ma:g}, "
            f"sensor {one.sensor_ma:g}, board {one.board_ma:g}, reserve {one.reserve_ma:g}); "
            f"{one.hours:.1f} h on {one.capacity_mah:g} mAh"
        )
    for source in dict.fromkeys(one.source for one in found):
        print(f"from the {source}")
    return 0


def _discharge(args: argparse.Namespace, folder: Path) -> int:
    from brachium_nodes.discharge import cells, discharge
    from brachium_nodes.firmware_build import build

    found = discharge(folder, build(folder / "build"), cells())
    ahead = [one.warned_min for one in found if one.warned_min is not None]
    figures = {
        "cells": len(found),
        "never_warned": len(found) - len(ahead),
        "warned_min": {"least": min(ahead), "median": median(ahead), "most": max(ahead)},
        "later_than_20_min": sum(minutes < 20.0 for minutes in ahead),
        "earlier_than_35_min": sum(minutes > 35.0 for minutes in ahead),
        "discharges": found,
    }
    if args.json:
        print_json(figures)
        return 0
    print(
        f"{len(found)} cells: warned {min(ahead):.1f} to {max(ahead):.1f} min before the end, "
        f"median {median(ahead):.1f}; never warned: {len(found) - len(ahead)}"
    )
    return 0


def _run(args: argparse.Namespace, folder: Path) -> int:
    from brachium.firmware_run import FirmwareRun
    from brachium.processes import Processes

    with Processes() as processes:
        run = FirmwareRun(
            folder=folder,
            seconds=args.seconds,
            rate_hz=args.rate,
            faults=args.run == "faults",
            processes=processes,
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
    print(
        f"memory: {figures.heap_peak_k:.1f} of 36 K at most, beside {figures.heap_shim_k:.1f} K for the "
        f"chip's own modules; {figures.skeletons} skeletons"
    )
    return 0
