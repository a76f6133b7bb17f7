"""A comparison as tables for people."""

from brachium_viewer.agreement import FOLLOWING, LARGE_P, Agreement
from brachium_viewer.compare import Aligned, Comparison
from brachium_viewer.statistics import ErrorFigures

ROUNDING_DEG = 1e-9
"""Smaller angles are what float64 leaves over; people are shown 0."""


def text(comparison: Comparison) -> str:
    """Return the comparison as tables for people."""
    c = comparison
    lines = [f"{c.a} against {c.b}: {c.rows} rows" + (f" where {c.mask}" if c.mask else "")]
    lines += _aligned(c.aligned) if c.aligned is not None else []
    lines += ["", f"{'':<44}{'RMSE':>10}{'bias':>10}{'SD':>10}{'largest':>10}{'n':>9}"]
    for stem, o in c.orientations.items():
        lines += [_line(f"{stem}, whole angle, deg", o.total)]
        lines += [_line("  heading, deg", o.heading), _line("  inclination, deg", o.inclination)]
    lines += [_line(f"{pair}, deg", e) for pair, e in c.relative.items()]
    lines += [_line(_named(c, name), e) for name, e in c.columns.items()]
    lines += _assumed(c)
    if c.agreement:
        lines += ["", "agreement, row by row", _HEAD]
        lines += [_agreement(_named(c, name), e) for name, e in c.agreement.items()]
    lines += _repetitions(c)
    if c.agreement:
        lines += ["", f"{FOLLOWING};", f"{LARGE_P}."]
    return "\n".join(lines) + "\n"


_HEAD = (
    f"{'':<44}{'bias':>10}  {'95 % limits of agreement':>30}"
    f"{'r':>8}{'ICC(2,1)':>10}{'CCC':>8}{'p':>9}{'n':>9}"
)


def _named(c: Comparison, name: str) -> str:
    unit = c.units.get(name, "")
    return f"{name}, {unit}" if unit else name


def _shown(name: str, value: float) -> float:
    return 0.0 if name.endswith("deg") and abs(value) < ROUNDING_DEG else value


def _line(name: str, e: ErrorFigures) -> str:
    rmse, bias, sd, largest = (_shown(name, x) for x in (e.rmse, e.bias, e.sd, e.max_abs))
    return f"{name:<44}{rmse:>10.4g}{bias:>10.3g}{sd:>10.3g}{largest:>10.4g}{e.n:>9}"


def _agreement(name: str, e: Agreement) -> str:
    bias, low, high = (_shown(name, x) for x in (e.bias, *e.limits))
    limits = f"{low:.3g} to {high:.3g}" + (f" (+-{e.limits_margin:.2g})" if e.limits_margin else "")
    return (
        f"{name:<44}{bias:>10.3g}  {limits:>30}"
        f"{_of(e.r):>8}{_of(e.icc):>10}{_of(e.ccc):>8}{_probability(e.wilcoxon_p):>9}{e.n:>9}"
    )


def _of(value: float | None) -> str:
    return "-" if value is None else f"{value:.3f}"


def _probability(p: float | None) -> str:
    if p is None:
        return "-"
    return "< 0.001" if p < 0.001 else f"{p:.3f}"


def _aligned(a: Aligned) -> list[str]:
    lines = []
    if a.lag_s:
        lines.append(f"lag {1e3 * a.lag_s:.1f} ms taken out")
    if a.frame is not None:
        f = a.frame
        parts = [] if f.turn_deg is None else [f"orientations turned by {f.turn_deg:.2f} deg"]
        if f.positions_shift_m is not None:
            shift = ", ".join(f"{1e3 * x:.1f}" for x in f.positions_shift_m)
            parts.append(f"positions turned by {f.positions_turn_deg:.2f} deg and shifted by {shift} mm")
        lines.append(f"frame ({f.kind}): {'; '.join(parts) or 'nothing to turn'}")
    lines += [
        f"mean RMSE of {kind}: {a.before[kind]:.4g} before, {after:.4g} after aligning"
        for kind, after in a.after.items()
        if kind in a.before
    ]
    return lines


def _assumed(c: Comparison) -> list[str]:
    """Return which columns are no measurement, together where it holds for the same rows."""
    alike: dict[str, list[str]] = {}
    for name, shares in c.assumed.items():
        said = " and ".join(
            f"{100.0 * share:.3g} % of {side.upper()}'s rows" for side, share in shares.items() if share
        )
        alike.setdefault(said, []).append(name)
    return [f"assumed, not measured, in {said}: {', '.join(names)}" for said, names in alike.items()]


def _repetitions(c: Comparison) -> list[str]:
    if not c.repetitions:
        return []
    lines = ["", f"{len(c.repetitions)} repetitions by {c.repetitions_of}"]
    lines.append(f"{'':<44}{'RMSE':>10}{'+-':>8}{'highest: bias':>15}{'ICC':>8}{'reach: bias':>13}{'ICC':>8}")
    for column, e in c.per_repetition.items():
        name = _named(c, column)
        lines.append(
            f"{name:<44}{_shown(name, e.rmse.bias):>10.4g}{_shown(name, e.rmse.sd):>8.2g}"
            f"{_shown(name, e.highest.bias):>15.3g}{_of(e.highest.icc):>8}"
            f"{_shown(name, e.reach.bias):>13.3g}{_of(e.reach.icc):>8}"
        )
    return lines
