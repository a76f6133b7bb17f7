"""Fit the sensors' own calibration from a recording or a capture folder, and keep it for the gateway.

Raw samples are what is fitted, whatever calibration was in use; they are not changed. A rest of 3 s gives the
gyroscope's bias, still poses all around the accelerometer's scale and bias, slow turns about every axis the
magnetometer's hard and soft iron. One recording may hold all three.

brachium sensor bench.mcap --out calibrations
  brachium sensor bench.mcap --node esp-3f21 --what gyro --out calibrations
"""

import argparse
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from brachium.option_types import folder
from brachium.shell import Usage, add_json, print_json

if TYPE_CHECKING:
    from brachium.raw_sensors import RawSensor
    from brachium_fusion.sensor_calibration import SensorFit
    from brachium_fusion.sensor_fits import Outcome, What
    from brachium_wire.calibration_file import CalibrationFile, Part


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    parser.add_argument("input", type=Path, metavar="INPUT", help="a recording (.mcap) or a capture folder")
    parser.add_argument("--node", metavar="ID", help="only this node's sensor")
    parser.add_argument("--segment", help="only the sensor on this segment")
    parser.add_argument("--subject", help="only this subject's sensors")
    parser.add_argument(
        "--what",
        default="all",
        choices=("gyro", "accel", "accel-faces", "mag", "mag-min-max", "all"),
        help="accel-faces: exactly six faces; mag-min-max: offset only; all: gyro, accel, mag",
    )
    parser.add_argument(
        "--out", type=folder, metavar="DIR", help="folder for one file a node, as brachium gateway takes it"
    )
    add_json(parser)


def run(args: argparse.Namespace) -> int:
    """Fit, tell, keep. 0 if anything was found."""
    from brachium import raw_sensors
    from brachium_fusion.sensor_fits import ALL, fit

    if not args.input.exists():
        raise FileNotFoundError(2, "no such recording or capture folder", str(args.input))
    whats: tuple[What, ...] = ALL if args.what == "all" else (args.what,)
    sensors = raw_sensors.chosen(raw_sensors.read(args.input, args.subject), args.node, args.segment)
    nodes = [sensor.node for sensor in sensors]
    if args.out is not None and len(set(nodes)) < len(nodes):
        raise Usage("one node sat on several segments or subjects; choose with --segment and --subject")
    outcomes = [(sensor, [fit(what, sensor.samples) for what in whats]) for sensor in sensors]
    written = {} if args.out is None else _keep(outcomes, args.out, args.input.name)
    if args.json:
        print_json([_figures(sensor, found, written) for sensor, found in outcomes])
    else:
        print("\n\n".join(_words(sensor, found, written) for sensor, found in outcomes))
        print(_tables(outcomes), end="")
    return 0 if any(_fits(found) for _, found in outcomes) else 1


def _fits(found: "list[Outcome]") -> "list[tuple[Part, SensorFit]]":
    return [(outcome.part, outcome.found) for outcome in found if not isinstance(outcome.found, str)]


def _with_fits(file: "CalibrationFile", found: "list[Outcome]", date: str, source: str) -> "CalibrationFile":
    from brachium_wire import calibration_file as kept

    for part, fit in _fits(found):
        more = kept.Fit(
            part=part,
            method=fit.method,
            date=date,
            source=source,
            scores=fit.scores,
            calibration=fit.calibration,
        )
        file = kept.with_fit(file, more)
    return file


def _keep(outcomes: "list[tuple[RawSensor, list[Outcome]]]", folder: Path, source: str) -> dict[str, Path]:
    """Add each sensor's fits to its node's file; return the files."""
    from brachium_wire import calibration_file as kept

    written: dict[str, Path] = {}
    date = datetime.now(UTC).isoformat(timespec="seconds")
    for sensor, found in outcomes:
        if _fits(found):
            path = written[sensor.node] = kept.path_of(folder, sensor.node)
            new = kept.CalibrationFile(node=sensor.node, chip=sensor.chip)
            kept.write(path, _with_fits(kept.read(path) if path.exists() else new, found, date, source))
    return written


def _figures(sensor: "RawSensor", found: "list[Outcome]", written: dict[str, Path]) -> dict[str, Any]:
    return {
        "node": sensor.node,
        "segment": sensor.segment,
        "chip": sensor.chip,
        "file": written.get(sensor.node),
        "fits": {
            o.what: {"refused": o.found} if isinstance(o.found, str) else _plain(o.found) for o in found
        },
    }


def _plain(fit: "SensorFit") -> dict[str, Any]:
    from msgspec import to_builtins

    return {"method": fit.method, "scores": fit.scores, "calibration": to_builtins(fit.calibration)}


def _words(sensor: "RawSensor", found: "list[Outcome]", written: dict[str, Path]) -> str:
    lines = [f"{sensor.node} on {sensor.segment}"]
    for outcome in found:
        if isinstance(outcome.found, str):
            said = f"refused: {outcome.found}"
        else:
            scores = (f"{name} {value:.3g}" for name, value in outcome.found.scores.items())
            said = f"{outcome.found.method}: {', '.join(scores)}"
        lines.append(f"  {outcome.what:<12} {said}")
    if sensor.node in written:
        lines.append(f"  kept in {written[sensor.node]}")
    return "\n".join(lines)


def _tables(outcomes: "list[tuple[RawSensor, list[Outcome]]]") -> str:
    """Return what capture.toml takes of these fits, with a line before it; "" if there are none."""
    from brachium_wire.calibration_file import CalibrationFile, to_toml

    found = {
        sensor.segment: _with_fits(CalibrationFile(node=sensor.node), fitted, "", "").calibration
        for sensor, fitted in outcomes
        if _fits(fitted)
    }
    return f"\nfor capture.toml:\n\n{to_toml(found)}" if found else ""
