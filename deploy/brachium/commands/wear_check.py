"""Find which node sits where, and whether it is turned: 10 s an arm, with words for what to do.

In a running network it says when to hang, raise and bend each arm. For a recording or a capture folder,
give where this happened, once for each arm, in seconds from the first sample. 0: everything is worn as it
should be; 1: something is to be changed, or nothing can be said.

brachium wear-check --subject p01
  brachium wear-check first.mcap --moved right --hang 1:4 --raise 4:7.5 --bend 7.5:11
"""

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from brachium.option_types import span_s
from brachium.shell import Failed, Usage, add_json, add_network, print_json, stop_on_signals

if TYPE_CHECKING:
    from brachium.wear_passes import Outcome, Plan, Sensors
    from brachium_body.segments import Side

SPANS = ("hang", "raise", "bend")


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the options of wear checks."""
    add_network(parser)
    add_json(parser)
    parser.add_argument(
        "input", nargs="?", type=Path, metavar="INPUT", help="a recording (.mcap) or a capture folder"
    )
    parser.add_argument("--subject", help="who wears the sensors (default: p01; the only one of a recording)")
    parser.add_argument(
        "--side", choices=("right", "left", "both"), help="which arms to check (default: those with nodes)"
    )
    parser.add_argument(
        "--moved", action="append", default=[], choices=("right", "left"), help="which arm moved, in INPUT"
    )
    for name in SPANS:
        what = f"when it was to {name}, in INPUT"
        parser.add_argument(
            f"--{name}", action="append", default=[], type=span_s, metavar="FROM:TO", help=what
        )


def run(args: argparse.Namespace) -> int:
    """Check, and tell what to change."""
    from brachium.wear_passes import CannotTell, Outcome, examine
    from brachium_fusion.wear_check import WearCheck

    given = [args.moved, *(getattr(args, name) for name in SPANS)]
    if args.input is None and any(given):
        raise Usage("--moved, --hang, --raise and --bend belong to a recording or a capture folder: name it")
    if args.input is not None and args.side:
        raise Usage("--side belongs to a running network; say --moved for a recording or a capture folder")
    try:
        outcome = examine(*(_live(args) if args.input is None else _recorded(args)))
    except CannotTell as refusal:
        outcome = Outcome(WearCheck(findings=(), refused=str(refusal)), {}, ())
    if args.json:
        print_json(_figures(outcome))
    elif words := _words(outcome):
        print(words)
    if outcome.check.refused:
        raise Failed(f"nothing can be said: {outcome.check.refused}")
    return 0 if outcome.fine else 1


def _live(args: argparse.Namespace) -> "tuple[Sensors, list[Plan]]":
    from brachium.wear_guide import Guide
    from brachium_wire.bus import Bus

    asked: list[Side] = []
    if args.side:
        asked = ["right", "left"] if args.side == "both" else [args.side]
    stop = stop_on_signals()
    with Bus.open(args.endpoint, stop=stop) as bus:
        guide = Guide(bus, args.room, args.subject or "p01", _say, stop)
        plans = guide.run(asked)
        return guide.heard.sensors(), plans


def _say(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


def _recorded(args: argparse.Namespace) -> "tuple[Sensors, list[Plan]]":
    from brachium.wear_passes import Plan, extent

    spans = [getattr(args, name) for name in SPANS]
    if not args.moved or any(len(given) != len(args.moved) for given in spans):
        raise Usage("say --moved, --hang, --raise and --bend, each once for an arm")
    if len(set(args.moved)) < len(args.moved):
        raise Usage(f"--moved {args.moved[0]} was given twice; each arm is checked once")
    sensors = _read(args)
    first_s, last_s = extent(sensors)
    for name, given in zip(SPANS, spans, strict=True):
        for _, to_s in given:
            if to_s > last_s - first_s:
                raise Usage(f"--{name} ends at {to_s:g} s; the samples end at {last_s - first_s:.3f} s")
    plans = []
    for side, hang, up, bend in zip(args.moved, *spans, strict=True):
        shifted = [(first_s + a, first_s + b) for a, b in (hang, up, bend)]
        plans.append(Plan(side, {"hang": shifted[0], "raise": shifted[1], "bend": shifted[2]}))
    return sensors, plans


def _read(args: argparse.Namespace) -> "Sensors":
    from brachium import wear_passes
    from brachium_wire import capture, keys, recording

    if not args.input.exists():
        raise FileNotFoundError(2, "no such recording or capture folder", str(args.input))
    if args.input.is_dir():
        return wear_passes.of_capture(capture.load(args.input))
    heard: dict[str, wear_passes.Heard] = {}
    with recording.read(args.input) as messages:
        for key, payload, _ in messages:
            try:
                parsed = keys.parse(key)
            except keys.BadKey:
                continue
            if parsed.topic in ("info", "imu") and args.subject in (None, parsed.subject):
                heard.setdefault(parsed.subject or "", wear_passes.Heard()).take(key, payload)
    if len(heard) != 1:
        there = ", ".join(sorted(heard)) or "no such subject"
        raise Usage(f"the recording must hold one subject, or --subject name it; there is {there}")
    return next(iter(heard.values())).sensors()


def _words(outcome: "Outcome") -> str:
    lines = [f"{name}: not checked; it {why}" for name, why in outcome.left_out.items()]
    if outcome.assumed:
        lines.append(
            f"nobody told how {', '.join(outcome.assumed)} should be worn: taken as the axes on the segment"
        )
    return "\n".join([*lines, *(finding.text for finding in outcome.check.findings)])


def _figures(outcome: "Outcome") -> dict[str, object]:
    return {
        "fine": outcome.fine,
        "refused": outcome.check.refused,
        "findings": [
            {"segment": f.segment, "seat": f.seat, "turn": f.turn, "fine": f.fine, "text": f.text}
            for f in outcome.check.findings
        ],
        "left_out": outcome.left_out,
        "mounting_assumed": list(outcome.assumed),
    }
