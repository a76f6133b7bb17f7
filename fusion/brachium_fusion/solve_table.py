"""What was solved as a table that says what repeats it. Pure."""

from brachium_body.segments import SIDES
from brachium_fusion.result import tabulate
from brachium_fusion.result_quality import assumptions
from brachium_fusion.solve_terms import Outcome, SolveSettings
from brachium_fusion.zhou_recording import ZHOU
from brachium_wire.table import Table


def tabled(settings: SolveSettings, outcome: Outcome) -> Table:
    """Return the table that `solve` writes; its metadata's `settings` solve the same input to it again."""
    skeletons = outcome.skeletons
    made = tabulate(skeletons, outcome.times_ns, outcome.times_s, settings.groups)
    return Table(
        made.columns,
        made.units,
        {
            "made_by": "brachium solve",
            "input": settings.input.name,
            "filter": _filter(settings, outcome),
            "magnetometer": outcome.magnetometer,
            "mode": settings.mode,
            "forward": skeletons[-1].forward,
            "origin": skeletons[-1].origin,
            "sides": [side for side in SIDES if any(s.side == side for s in skeletons)],
            "assumed": assumptions(skeletons),
            **outcome.metadata,
            "settings": repeating(settings, outcome),
        },
    )


def repeating(settings: SolveSettings, outcome: Outcome) -> dict[str, object]:
    """Return the settings by the names that `solve --settings` reads, with what fusion chose by itself."""
    return {
        **outcome.chosen.plain(),
        "filter": _filter(settings, outcome),
        "rate_hz": settings.rate_hz,
        "mode": settings.mode,
        "subject": settings.subject,
        "columns": list(settings.groups),
    }


def _filter(settings: SolveSettings, outcome: Outcome) -> str:
    return settings.filter if settings.filter in ZHOU else outcome.chosen.filter
