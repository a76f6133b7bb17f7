"""A live comparison of two sensors as tables for people, laid out as Tables 4 and 5 of the paper."""

from brachium_viewer.live_comparison import LiveComparison
from brachium_viewer.two_sensors import Agreed

NAMES = {"elbow": "elbow", "wrist": "wrist", "hand": "end effector"}
PAPER: dict[str, dict[str, tuple[float, float, float]]] = {
    "forearm": {"wrist": (12.6, 50.9, 16.1), "hand": (18.2, 70.6, 22.9)},
    "upper_arm": {"elbow": (6.1, 46.2, 8.7), "wrist": (7.2, 54.7, 10.3), "hand": (7.6, 57.7, 10.9)},
}
"""Tsilomitrou et al. 2021, Tables 4 and 5: MAE, largest and RMSE of eq 17 against a Shimmer3, mm."""


def text(c: LiveComparison) -> str:
    """Return the comparison as tables for people."""
    f = c.found
    chips = ", ".join(f"{name}: {chip}" for name, chip in c.chips.items())
    lines = [
        f"{c.b} against {c.a} ({chips}), {c.side} arm{f', {c.exercise}' if c.exercise else ''}: "
        f"{f.rows} instants that both measured"
    ]
    if c.origin != "worn":
        lines.append(f"not worn by a person: {c.origin}")
    lines += ["", *_clock(c), *_seats(c)]
    lines += _table("as worn, the clocks' offset taken out", c, f.as_worn)
    lines += _table("mounting and heading between both taken out too", c, f.aligned)
    if f.truth:
        lines += [
            "",
            "as worn, against what the emulated wearer does, mm" + " " * 9 + "mean     SD   RMSE  largest",
        ]
        for key, name in (("a", c.a), ("b", c.b)):
            for joint, e in f.truth.get(key, {}).items():
                lines.append(
                    f"  {name} {NAMES[joint]:<42}"[:54].ljust(54) + _mm(e.bias, e.sd, e.rmse, e.max_abs)
                )
    return "\n".join(lines) + "\n"


def _clock(c: LiveComparison) -> list[str]:
    clock, hosts = c.found.clock, c.hosts
    lines = [
        f"clock: the times of {c.b} are {1e3 * clock.offset_s:+.1f} ms +- {1e3 * clock.margin_s:.1f} ms "
        f"(95 %) against those of {c.a},",
        f"  by {clock.seconds:.0f} s of the turning of {c.found.segment} "
        f"(correlation {clock.correlation:.4f}, drift {clock.drift_ppm:+.0f} +- "
        f"{clock.drift_margin_ppm:.0f} ppm); taken out",
    ]
    stated = ", ".join(f"{name} +- {1e3 * s:.1f} ms" for name, s in c.hosts.stated_s.items())
    if hosts.apart_s is not None and hosts.margin_s is not None:
        lines.append(f"  hosts' clocks: {1e3 * hosts.apart_s:+.2f} ms +- {1e3 * hosts.margin_s:.2f} ms apart")
    within = abs(clock.offset_s) <= sum(hosts.stated_s.values()) + clock.margin_s
    lines.append(
        f"  the sensors' own stated times: {stated}; the offset is {'within' if within else 'BEYOND'} that"
    )
    return lines


def _seats(c: LiveComparison) -> list[str]:
    lines = []
    for segment, seat in c.found.removed.items():
        mounting = (
            "mounting: the movement does not tell it"
            if seat.mounting_deg is None
            else f"mounting {seat.mounting_deg:.1f} deg"
        )
        lines.append(f"between both on {segment}: {mounting}, heading {seat.heading_deg:+.1f} deg")
    return lines


def _table(title: str, c: LiveComparison, agreed: Agreed) -> list[str]:
    lines = ["", f"{title}, mm", f"  {'':<14}{'eq 17':>7}{'':>16}  {'in three dimensions':>27}"]
    lines.append(
        f"  {'':<14}{'MAE':>7}{'largest':>9}{'RMSE':>7}  {'mean':>7}{'SD':>7}{'RMSE':>7}{'largest':>9}"
    )
    paper = PAPER.get(c.found.segment[:-2], {})
    for joint, p in agreed.places.items():
        n = p.eq17
        norms = f"{1e3 * n.mae:>7.1f}{1e3 * n.largest:>9.1f}{1e3 * n.rmse:>7.1f}"
        lines.append(
            f"  {NAMES[joint]:<14}{norms}  " + _mm(p.apart.bias, p.apart.sd, p.apart.rmse, p.apart.max_abs)
        )
        for axis, e in p.axes.items():
            lines.append(f"  {'':<12}{axis} {'':<23}  " + _mm(e.bias, e.sd, e.rmse, e.max_abs))
        if joint in paper:
            stated = "".join(f"{x:>{w}.1f}" for x, w in zip(paper[joint], (7, 9, 7), strict=True))
            lines.append(f"  {'  the paper':<14}{stated}")
    for segment, o in agreed.orientations.items():
        lines.append(
            f"  {segment}: whole angle {o.total.rmse:.2f} deg RMSE, heading {o.heading.rmse:.2f}, "
            f"inclination {o.inclination.rmse:.2f}"
        )
    return lines


def _mm(mean: float, sd: float, rmse: float, largest: float) -> str:
    return f"{1e3 * mean:>7.1f}{1e3 * sd:>7.1f}{1e3 * rmse:>7.1f}{1e3 * largest:>9.1f}"
