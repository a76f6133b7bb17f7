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
from typing import TYPE_CHECKING, Any

from brachium.option_types import span_s
from brachium.shell import Failed, Usage, add_json, add_network, print_json, stop_on_signals

if TYPE_CHECKING:
    from brachium_fusion.wear_passes import Plan, Sensors
    from brachium_wire.messages import Calibration

SPANS = ("hang", "raise", "bend")
EXAMINED_S = 10.0
"""What was heard is examined within this, on a busy machine."""


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
    given = [args.moved, *(getattr(args, name) for name in SPANS)]
    if args.input is None and any(given):
        raise Usage("--moved, --hang, --raise and --bend belong to a recording or a capture folder: name it")
    if args.input is not None and args.side:
        raise Usage("--side belongs to a running network; say --moved for a recording or a capture folder")
    found = _live(args) if args.input is None else _recorded(args)
    if args.json:
        print_json(found)
    elif words := _words(found):
        print(words)
    if found["refused"]:
        raise Failed(f"nothing can be said: {found['refused']}")
    return 0 if found["fine"] else 1


def _live(args: argparse.Namespace) -> dict[str, Any]:
    """Ask fusion, which leads the wearer; say what it says."""
    from brachium.asking import asked
    from brachium_fusion.wear_guide import LONGEST_S
    from brachium_wire import keys
    from brachium_wire.bus import Bus

    subject, said = args.subject or "p01", _Said()
    arguments = {"side": args.side} if args.side else {}
    stop = stop_on_signals()
    with Bus.open(args.endpoint, stop=stop) as bus:
        news = bus.subscribe(keys.calibration(args.room, subject))
        key = keys.command(args.room, subject, "wear-check")
        answer = asked(bus, key, arguments, news, said.show, stop, LONGEST_S + EXAMINED_S)
    if answer is None:
        if stop.is_set():
            raise Failed("nothing can be said: stopped before its end")
        raise Failed("fusion does not answer; is `brachium fuse` running in this room?")
    if not answer.data:
        raise Failed(answer.reason)
    return answer.data


class _Said:
    """What was said last: an instruction once, then a countdown."""

    def __init__(self) -> None:
        self._words, self._left_s = "", 0

    def show(self, news: "Calibration") -> None:
        """Say what is new of a check that runs."""
        wear = news.wear
        if wear is None or wear.state != "running" or not wear.reason:
            return
        if wear.reason != self._words:
            _say(wear.reason)
        elif wear.left_s != self._left_s:
            _say(f"  {wear.left_s}")
        self._words, self._left_s = wear.reason, wear.left_s


def _say(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


def _recorded(args: argparse.Namespace) -> dict[str, Any]:
    from brachium_fusion.wear_check import WearCheck
    from brachium_fusion.wear_passes import CannotTell, Outcome, examine, plain

    try:
        return plain(examine(*_asked_for(args)))
    except CannotTell as refusal:
        return plain(Outcome(WearCheck(findings=(), refused=str(refusal)), {}, ()))


def _asked_for(args: argparse.Namespace) -> "tuple[Sensors, list[Plan]]":
    from brachium_fusion.wear_passes import Plan, extent

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
    from brachium_fusion import wear_passes
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
                heard.setdefault(parsed.subject or "", wear_passes.Heard()).take(parsed, payload)
    if len(heard) != 1:
        there = ", ".join(sorted(heard)) or "no such subject"
        raise Usage(f"the recording must hold one subject, or --subject name it; there is {there}")
    return next(iter(heard.values())).sensors()


def _words(found: dict[str, Any]) -> str:
    lines = [f"{name}: not checked; it {why}" for name, why in found["left_out"].items()]
    if found["mounting_assumed"]:
        names = ", ".join(found["mounting_assumed"])
        lines.append(f"nobody told how {names} should be worn: taken as the axes on the segment")
    return "\n".join([*lines, *(finding["text"] for finding in found["findings"])])
