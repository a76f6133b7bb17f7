"""Run the whole network on this machine: an emulated wearer, every service, live view, recording, summary.

brachium demo --seconds 30 --exercise drinking
"""

import argparse
import importlib.util
import secrets
import sys
import time
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING

from brachium.option_types import duration_s, folder, probability, seed
from brachium.shell import Failed, Usage, add_json, as_json, print_json, stop_on_signals
from brachium.way_in import TOKEN_VARIABLE

if TYPE_CHECKING:
    from brachium.demo_report import DemoReport
    from brachium_nodes.emulate import EmulateReport, EmulateSettings

ALONE_S = 30.0
"""How long a demo without a display goes on."""
LOOK_S = 0.1
FAULTS = {
    "typical": {"loss": 0.01, "swap": 0.002, "wifi": "good"},
    "ideal": {"loss": 0.0, "swap": 0.0, "wifi": "none"},
}
"""What goes wrong on the way, by level."""


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the demo's options."""
    parser.add_argument(
        "--seconds", type=duration_s, help="how long (default: Ctrl-C ends; without a display 30)"
    )
    parser.add_argument(
        "--exercise", default="elbow-flexion", help="what the wearer does; an unknown name lists all"
    )
    parser.add_argument("--level", default="typical", choices=sorted(FAULTS), help="of sensors and radio")
    parser.add_argument("--arms", default="right", help="right, left or both")
    parser.add_argument("--seed", type=seed, default=1, help="of everything random")
    parser.add_argument(
        "--nodes",
        default="emulated",
        choices=["emulated", "micropython"],
        help="what wearables are; micropython: their own firmware runs here",
    )
    parser.add_argument(
        "--loss", type=probability, help="probability that a packet is lost (default: by level)"
    )
    parser.add_argument("--headless", action="store_true", help="without the live view")
    parser.add_argument("--out", type=folder, metavar="DIR", help="default: brachium-demo/<date and time>")
    add_json(parser)


def run(args: argparse.Namespace) -> int:
    """Run the demo and tell what it has shown."""
    begun = time.monotonic()
    folder = args.out or Path("brachium-demo") / datetime.now().strftime("%Y-%m-%dT%H-%M-%S")
    if folder.exists() and any(folder.iterdir()):
        raise Usage(f"{folder} is not empty; give --out a folder that is new")
    if not args.headless and importlib.util.find_spec("rerun") is None:
        raise Failed("the live view needs pip install 'brachium[view]'; without it give --headless")
    report = _demo(args, folder, begun)
    (folder / "demo.json").write_text(as_json(report) + "\n", encoding="utf-8")
    if args.json:
        print_json(report)
    else:
        from brachium.demo_report import text

        print(text(report))
    if report.problem:
        raise Failed(report.problem)
    return 0


def _demo(args: argparse.Namespace, folder: Path, begun: float) -> "DemoReport":
    from brachium.commands.emulate import settings_of
    from brachium.demo_network import ROOM, DemoNetwork
    from brachium.processes import Processes
    from brachium_wire import keys
    from brachium_wire.bus import Bus

    stop, words, first_s = stop_on_signals(), _wearer_words(args), None
    token = secrets.token_urlsafe(16)
    wearer = settings_of(words, token)  # before anything starts: bad input is said at once
    with Processes(environment={TOKEN_VARIABLE: token}) as processes:
        network = DemoNetwork(folder=folder, processes=processes)
        network.start(wearer, view=not args.headless)
        with Bus.open(network.endpoint, stop=stop) as bus:
            statuses = bus.subscribe(keys.subjects(ROOM, "imu/*/status"))
            skeletons = bus.subscribe(keys.subjects(ROOM, "skeleton/*"), 1)
            network.wait_ready(bus, stop)
            if stop.is_set():
                raise Failed("stopped before the network was up")
            _say(f"network up after {time.monotonic() - begun:.1f} s: {network.endpoint}, {network.gateway}")
            network.move(words)
            told = args.headless
            while not stop.wait(LOOK_S) and network.moving():
                network.check()
                if first_s is None and skeletons.wait(0.0):
                    first_s = time.monotonic() - begun
                if not told and (address := network.view_address()):
                    _say(f"live view: {address}")
                    told = True
            sent = network.rest(statuses)
            recording = network.finish_recording()
    return _report(args, wearer, sent, recording, first_s)


def _report(
    args: argparse.Namespace,
    wearer: "EmulateSettings",
    sent: "EmulateReport",
    recording: Path,
    first_s: float | None,
) -> "DemoReport":
    from brachium import demo_report
    from brachium_viewer import summary
    from brachium_viewer.figures import figures
    from brachium_wire.table import MissingExtra

    page, notes = recording.with_name("summary.html"), []
    try:
        found = summary.write(recording, page, f"Demo: {args.exercise}")
    except MissingExtra as error:
        notes.append(str(error))
        found = figures(recording)
    segments = demo_report.segment_counts(found, sent)
    arms = {name: demo_report.arm_report(arm) for name, arm in found.arms.items()}
    return demo_report.DemoReport(
        exercise=wearer.wearer.exercise,
        level=wearer.wearer.level,
        seed=wearer.wearer.seed,
        seconds=found.duration_s if wearer.seconds is None else min(wearer.seconds, found.duration_s),
        first_skeleton_s=first_s,
        segments=segments,
        arms=arms,
        recording=str(recording),
        summary=str(page) if page.exists() else "",
        problem=demo_report.problem(segments, arms),
        notes=notes,
    )


def _wearer_words(args: argparse.Namespace) -> list[str]:
    """Return the command line of the emulated wearer."""
    faults = {**FAULTS[args.level], **({} if args.loss is None else {"loss": args.loss})}
    if args.nodes == "micropython":
        faults = {}  # the firmware meets its own: a bus that refuses
    words = [
        "--nodes",
        args.nodes,
        "--exercise",
        args.exercise,
        "--arms",
        args.arms,
        "--level",
        args.level,
        "--seed",
        str(args.seed),
    ]
    for name, value in faults.items():
        words += [f"--{name}", str(value)]
    from brachium_viewer.live import has_display

    seconds = args.seconds
    if seconds is None and (args.headless or not has_display()):
        seconds = ALONE_S
    return words if seconds is None else [*words, "--seconds", str(seconds)]


def _say(text: str) -> None:
    print(text, file=sys.stderr, flush=True)
