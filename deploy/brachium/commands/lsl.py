"""Stream a room by Lab Streaming Layer and bring markers back, or find taps on a sensor in a recording.

brachium lsl
  brachium lsl --taps recordings/session.mcap --camera 12.48
"""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from brachium.option_types import real
from brachium.shell import Failed, Usage, add_json, add_network, print_json, serve

if TYPE_CHECKING:
    from brachium_viewer.lsl.tap_report import Tapped


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    add_network(parser)
    add_json(parser)
    parser.add_argument("--subject", help="only this subject (default: everybody)")
    parser.add_argument(
        "--scope",
        choices=("machine", "link", "site"),
        default="machine",
        help="who finds the streams: programs on this machine, in its subnet, or in the whole site",
    )
    parser.add_argument("--id", default="lsl", help="names the service")
    parser.add_argument(
        "--taps",
        type=Path,
        metavar="INPUT",
        help="find where a sensor was tapped three times in a recording or a capture folder, and end",
    )
    parser.add_argument(
        "--camera",
        type=real(),
        metavar="SECONDS",
        help="with --taps: time in the camera's film of the very first tap; gives the camera's lag",
    )


def run(args: argparse.Namespace) -> int:
    """Stream, or look for taps."""
    if args.taps is not None:
        return _taps(args)
    if args.camera is not None or args.json:
        raise Usage("--camera and --json belong to --taps INPUT; write that too, or leave them out")
    from brachium_viewer.lsl import service

    settings = service.LslSettings(
        endpoint=args.endpoint, room=args.room, subject=args.subject, scope=args.scope, id=args.id
    )
    return serve(lambda stop: service.run(settings, stop))


def _taps(args: argparse.Namespace) -> int:
    from brachium_viewer.lsl.tap_report import taps_in

    found = [one for one in taps_in(args.taps, args.camera) if args.subject in (None, one.subject)]
    if args.json:
        print_json(found)
    for one in found if not args.json else ():
        print(_line(one))
    if not found:
        raise Failed(
            f"{args.taps}: no sensor was tapped three times; rest half a second, tap it firmly three times "
            "within two seconds, rest again"
        )
    return 0


def _line(one: "Tapped") -> str:
    pauses = [(b - a) * 1e-9 for a, b in zip(one.times_ns, one.times_ns[1:], strict=False)]
    text = (
        f"{one.subject} {one.segment}: tapped at {one.first_s:.3f} s from the first sample, "
        f"then after {pauses[0]:.3f} and {pauses[1]:.3f} s"
    )
    if one.camera_lag_s is None:
        return text
    return f"{text}; camera time = time from the first sample {one.camera_lag_s:+.3f} s"
