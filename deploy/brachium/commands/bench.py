"""Measure this machine: what one arm costs, how late its skeletons are, what a hundred arms cost.

brachium bench --quick
  brachium bench --gateway
  brachium bench --clock --runs 200 --json
  brachium bench --can load --json
  brachium bench --hostile 1000000 --json
  brachium bench --sensors --chips 10 --json
  brachium bench --exports
"""

import argparse
import sys
from dataclasses import asdict
from typing import Any

from brachium import figure_text
from brachium.option_types import whole
from brachium.shell import add_json, print_json

WINDOW_S, QUICK_WINDOW_S = 6.0, 1.0
SMOOTHED_WINDOWS = 10
"""Windows in the recording that is smoothed."""


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    parser.add_argument("--quick", action="store_true", help="short windows: a look, not a figure")
    parser.add_argument(
        "--arms", type=whole(0, 10_000), default=100, help="how many arms are many; 0 leaves them out"
    )
    other = parser.add_mutually_exclusive_group()
    other.add_argument("--gateway", action="store_true", help="instead: what many nodes cost the gateway")
    other.add_argument("--clock", action="store_true", help="instead: how well nodes' clocks are known")
    other.add_argument(
        "--hostile", type=whole(1, 100_000_000), metavar="FRAMES", help="instead: a gateway under attack"
    )
    other.add_argument("--sensors", action="store_true", help="instead: how well sensors are calibrated")
    other.add_argument(
        "--exports", action="store_true", help="instead: how exported files agree in others' readers"
    )
    parser.add_argument("--chips", type=whole(1, 1000), default=10, help="of --sensors")
    other.add_argument(
        "--can",
        choices=["load", "mixing", "faults"],
        help="instead: what CAN sensors cost; whether their samples mix; what a machine hears of a fault",
    )
    other.add_argument("--page", action="store_true", help="instead: how late the page draws; what it costs")
    other.add_argument(
        "--report", action="store_true", help="instead: what a 20-minute session's report costs"
    )
    other.add_argument("--recorder", action="store_true", help="instead: what a kill or a full disk costs")
    parser.add_argument("--kills", type=whole(1, 1000), default=20, help="of --recorder")
    parser.add_argument("--nodes", type=whole(1, 500), default=256, help="of --gateway")
    parser.add_argument("--runs", type=whole(1, 10_000), default=200, help="of --clock")
    add_json(parser)


def run(args: argparse.Namespace) -> int:
    """Measure, one network after the other."""
    if args.exports:
        return _exports(args)
    parts = (args.gateway, args.clock, args.sensors, args.can, args.recorder, args.page, args.report)
    if any(parts) or args.hostile is not None:
        return _other(args)
    figures = measure(QUICK_WINDOW_S if args.quick else WINDOW_S, args.arms)
    if args.json:
        print_json(figures)
    else:
        print(text(figures))
    return 0


def _exports(args: argparse.Namespace) -> int:
    from brachium import bench_exports

    found = bench_exports.measure()
    if args.json:
        print_json(found)
    else:
        print(bench_exports.text(found))
    return 0


def _other(args: argparse.Namespace) -> int:
    """Measure one part alone; its figures are few enough to be told by name."""
    found: Any
    if args.gateway:
        from brachium import bench_gateway

        found = bench_gateway.measure(args.nodes, QUICK_WINDOW_S if args.quick else WINDOW_S)
    elif args.page:
        from brachium import bench_page

        found = bench_page.measure(QUICK_WINDOW_S if args.quick else 1.5 * WINDOW_S)
    elif args.report:
        from brachium import bench_report

        found = bench_report.measure(8.0, 1) if args.quick else bench_report.measure()
    elif args.clock:
        from brachium import bench_clock

        found = bench_clock.measure(args.runs)
    elif args.sensors:
        from brachium import bench_sensors

        found = bench_sensors.measure(args.chips)
    elif args.recorder:
        from brachium import bench_recorder

        found = bench_recorder.measure(args.kills)
    elif args.can:
        from brachium import bench_can

        found = bench_can.measure(args.can, QUICK_WINDOW_S if args.quick else WINDOW_S)
    else:
        from brachium import bench_hostile

        found = bench_hostile.measure(args.hostile)
    if args.json:
        print_json(found)
        return 0
    print("\n".join(figure_text.lines(found)))
    return 0


def measure(window_s: float, arms: int) -> dict[str, Any]:
    """Return all figures: one arm by samples a packet, and many arms."""
    from brachium import bench, bench_smoother

    print("a shoulder, smoothed ...", file=sys.stderr, flush=True)
    smoother = asdict(bench_smoother.measure(SMOOTHED_WINDOWS * window_s))
    one = {}
    for batch in (5, 1, 10):
        print(f"one arm, {batch} samples a packet ...", file=sys.stderr, flush=True)
        one[str(batch)] = asdict(bench.one_arm(batch, window_s))
    if not arms:
        return {"one_arm": one, "smoother": smoother}
    print(f"{arms} arms ...", file=sys.stderr, flush=True)
    many = asdict(bench.many_arms(arms, window_s))
    return {"one_arm": one, "many_arms": many, "smoother": smoother}


def text(figures: dict[str, Any]) -> str:
    """Return the figures for a person."""
    lines = ["one arm, three nodes at 100 Hz through the gateway", ""]
    lines.append(f"{'samples a packet':<44}" + "".join(f"{batch:>10}" for batch in figures["one_arm"]))
    rows = {
        "first_skeleton_s": ("from start to first skeleton, s", 1.0),
        "fusion_cpu": ("fusion, % of a core", 100.0),
        "relay_cpu": ("a bare relay of the same batches, % of a core", 100.0),
        "latency_p50_ms": ("gateway to skeleton, median ms", 1.0),
        "latency_p99_ms": ("gateway to skeleton, 99 % ms", 1.0),
        "sensor_to_skeleton_p50_ms": ("sensor to skeleton, median ms", 1.0),
        "sensor_to_skeleton_p99_ms": ("sensor to skeleton, 99 % ms", 1.0),
    }
    for name, (label, factor) in rows.items():
        values = [factor * one[name] for one in figures["one_arm"].values()]
        lines.append(f"{label:<44}" + "".join(f"{value:>10.1f}" for value in values))
    smoother = figures["smoother"]
    lines += ["", f"{'shoulder smoother, ms a sample':<44}{smoother['smoother_ms']:>10.4f}"]
    lines.append(f"{'VQF offline of both sensors, ms a sample':<44}{smoother['vqf_ms']:>10.4f}")
    many = figures.get("many_arms")
    if many is not None:
        lines += ["", f"{many['arms']} arms, 5 samples a packet, straight to the bus", ""]
        lines.append(f"{'fusion, % of a core':<44}{100.0 * many['fusion_cpu']:>10.1f}")
        lines.append(f"{'a bare relay of the same batches':<44}{100.0 * many['relay_cpu']:>10.1f}")
        lines.append(f"{'skeletons':<44}{many['skeletons']:>10}")
        lines.append(f"{'ticks without one':<44}{many['skeletons_missing']:>10}")
        lines.append(f"{'poses held or missing':<44}{many['poses_not_measured']:>10}")
        lines.append(f"{'dropped by fusion':<44}{sum(many['fusion_drops'].values()):>10}")
        lines.append(f"{'sender late by at most, ms':<44}{many['sender_late_ms']:>10.1f}")
    return "\n".join(lines)
