"""Calibrate a person's sensors in a running network: it says what to do, and how it went.

How they are worn, or, with --sensor, one sensor itself, before it is worn: bias, scale, iron. What is found
of a sensor is kept on its node.

brachium calibrate --subject p01 --routine guided
  brachium calibrate --subject p01 --sensor forearm_r
"""

import argparse
import threading
from typing import TYPE_CHECKING, Any

from brachium.option_types import real
from brachium.shell import Failed, Usage, add_json, add_network, print_json, stop_on_signals

if TYPE_CHECKING:
    from brachium_wire.bus import Bus, Inbox
    from brachium_wire.messages import Answer, Calibration

LONGEST_S = 300.0
"""No calibration takes longer; fusion itself gives up earlier."""


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the options of calibrations."""
    add_network(parser)
    add_json(parser)
    parser.add_argument("--subject", default="p01", help="who wears the sensors")
    parser.add_argument(
        "--routine",
        choices=("pose", "guided", "free"),
        default="guided",
        help="pose: stand still; guided: also bend the elbow, turn the palm, move freely; free: pose, then "
        "any movement",
    )
    parser.add_argument(
        "--pose", choices=("n-pose", "table", "given"), default="n-pose", help="to begin with"
    )
    parser.add_argument(
        "--angle",
        action="append",
        default=[],
        type=_angle,
        metavar="NAME=DEG",
        help="an angle held in the pose `given`, as in elbow_flexion=35",
    )
    parser.add_argument(
        "--seconds", type=real(1.0, 30.0), default=3.0, metavar="S", help="how long the pose is held"
    )
    parser.add_argument("--sensor", metavar="SEGMENT", help="calibrate this segment's sensor itself")
    parser.add_argument(
        "--steps",
        type=_steps,
        metavar="A,B",
        help="with --sensor: some of rest (gyroscope), faces (accelerometer), turn (magnetometer)",
    )
    parser.add_argument("--zero", action="store_true", help="only set headings anew: let the arms hang still")


def run(args: argparse.Namespace) -> int:
    """Ask fusion, and tell what it says."""
    from brachium_wire import keys
    from brachium_wire.bus import Bus

    if args.sensor is not None or args.steps is not None:
        return _sensor(args)
    angles = _held(args)
    stop = stop_on_signals()
    with Bus.open(args.endpoint, stop=stop) as bus:
        news = bus.subscribe(keys.calibration(args.room, args.subject))
        verb = "zero" if args.zero else "calibrate"
        arguments: dict[str, Any] = {"seconds": min(args.seconds, 2.0) if args.zero else args.seconds}
        if not args.zero:
            arguments |= {"pose": args.pose, "routine": args.routine, "angles_deg": angles}
        answer = _asked(bus, keys.command(args.room, args.subject, verb), arguments, news, stop, args.json)
    if answer is None:
        if stop.is_set():
            return 1
        raise Failed("fusion does not answer; is `brachium fuse` running in this room?")
    if args.json:
        print_json({"ok": answer.ok, "reason": answer.reason, **answer.data})
    elif answer.ok:
        print(_words(answer.data))
    if not answer.ok:
        raise Failed(answer.reason)
    return 0


def _sensor(args: argparse.Namespace) -> int:
    from brachium.calibrate_sensor import SensorCalibrationRun
    from brachium_body.segments import SEGMENTS
    from brachium_wire.bus import Bus

    if args.sensor is None:
        raise Usage("--steps belongs to --sensor: say whose, as in --sensor forearm_r")
    if args.sensor not in SEGMENTS:
        raise Usage(f"--sensor takes one of {', '.join(SEGMENTS)}; came {args.sensor!r}")
    if args.zero or args.angle:
        raise Usage("--sensor calibrates the sensor itself: no --zero and no --angle with it")
    stop = stop_on_signals()
    with Bus.open(args.endpoint, stop=stop) as bus:
        one = SensorCalibrationRun(bus, args.room, args.subject, args.sensor, stop)
        return one.run(args.steps, as_json=args.json)


def _held(args: argparse.Namespace) -> dict[str, float]:
    """Return the angles of the pose `given`, checked before anybody is asked."""
    from brachium_body.ranges import check_stated

    angles = dict(args.angle)
    if args.zero and (angles or args.pose != "n-pose"):
        raise Usage("--zero takes no --pose and no --angle: the arms hang still")
    if angles and args.pose != "given":
        raise Usage("--angle belongs to --pose given")
    if args.pose == "given" and not angles:
        raise Usage("--pose given needs the angles that are held: --angle elbow_flexion=35")
    try:
        check_stated(angles)
    except ValueError as error:
        raise Usage(f"--angle {error}") from None
    return angles


def _asked(
    bus: "Bus", key: str, arguments: dict[str, Any], news: "Inbox", stop: threading.Event, quiet: bool
) -> "Answer | None":
    """Ask, and show progress until the answer comes."""
    from brachium.asking import asked

    said = ""

    def show(progress: "Calibration") -> None:
        nonlocal said
        told = _line(progress)
        if told != said and told and not quiet:
            print(told, flush=True)
        said = told

    return asked(bus, key, arguments, news, show, stop, LONGEST_S)


def _line(news: "Calibration") -> str:
    """Return what to do now; empty once it is over."""
    if news.state not in ("waiting", "running"):
        return ""
    moving = f"; not still yet: {', '.join(news.moving)}" if news.moving else ""
    return f"{round(100 * news.progress):3d} %  {news.reason}{moving}"


def _words(data: dict[str, Any]) -> str:
    lines = [f"calibrated; forward: {data.get('forward', 'none')}"]
    lines += [f"  {name.replace('_', ' ')}: {value:.1f}" for name, value in data.get("scores", {}).items()]
    lines += [f"not found, {what.replace('_', ' ')}: {why}" for what, why in data.get("refused", {}).items()]
    lines += [f"warning: {warning}" for warning in data.get("warnings", [])]
    return "\n".join(lines)


def _angle(text: str) -> tuple[str, float]:
    name, equals, value = text.partition("=")
    if not equals or not name:
        raise argparse.ArgumentTypeError(f"{text!r} cannot be used: write NAME=DEG, as in elbow_flexion=35")
    return name, real(-360.0, 360.0)(value)


def _steps(text: str) -> list[str]:
    steps = text.split(",")
    if not set(steps) <= {"rest", "faces", "turn"}:
        raise argparse.ArgumentTypeError(f"{text!r} cannot be used: some of rest,faces,turn")
    return steps
