"""The report's numbers as a table: one row a repetition."""

from pathlib import Path
from typing import Any

import numpy as np

from brachium_viewer.exercises import PLANES_DEG
from brachium_viewer.metrics.repetition_measures import NAMES, RepetitionMeasures
from brachium_viewer.metrics.smoothness import CUTOFF_HZ, LDLJ_RATE_HZ
from brachium_viewer.sessions.records import SessionRecord
from brachium_wire import table

TEXTS = ("subject", "origin", "recording", "exercise", "side", "mode", "path_of", "shift_of")
COUNTS = ("set", "repetition")
TIMES = ("from", "to", "peak_at")
COVERAGES = {f"coverage_{name}": "1" for name in NAMES}
UNITS: dict[str, str] = {**dict.fromkeys(TIMES, "s"), **NAMES, **COVERAGES}
"""Times count from the first skeleton. Coverage is how much was measured of the time that a measure is of."""


def write(path: Path, session: SessionRecord, zero_ns: int) -> None:
    """Write the table, .csv or .parquet; raises TableError for another ending."""
    rows = tidy(session)
    columns: dict[str, Any] = {
        **{name: np.array([row[name] for row in rows], dtype=object) for name in TEXTS},
        **{name: np.array([row[name] for row in rows], dtype=np.int64) for name in COUNTS},
        **{name: np.array([row[name] for row in rows], dtype=np.float64) for name in UNITS},
        "withheld": np.array([row["withheld"] for row in rows], dtype=object),
    }
    table.write(
        path,
        {name: values.astype(str) if values.dtype == object else values for name, values in columns.items()},
        UNITS,
        {
            "title": "repetitions",
            "zero_ns": zero_ns,
            "method": session.method,
            "sparc_cutoff_hz": CUTOFF_HZ,
            "ldlj_rate_hz": LDLJ_RATE_HZ,
            "planes_deg": {name: list(band) for name, band in PLANES_DEG.items()},
            "settings": session.settings,
        },
    )


def tidy(session: SessionRecord) -> list[dict[str, Any]]:
    """Return a row a repetition; what is withheld is NaN, with its reason in `withheld`."""
    rows = []
    for number, one in enumerate(session.sets, start=1):
        exercise, side, mode = one.what
        for i, repetition in enumerate(one.measures.repetitions, start=1):
            rows.append(
                {
                    "subject": session.subject,
                    "origin": session.origin,
                    "recording": session.recording,
                    "exercise": exercise,
                    "side": side,
                    "mode": mode,
                    "path_of": one.measures.path_of,
                    "shift_of": one.measures.shoulder_word,
                    "set": number,
                    "repetition": i,
                    **_numbers(repetition),
                }
            )
    return rows


def _numbers(repetition: RepetitionMeasures) -> dict[str, Any]:
    found = repetition.measures
    reasons = [f"{name}: {one.withheld}" for name, one in found.items() if one.value is None]
    return {
        "from": repetition.from_s,
        "to": repetition.to_s,
        "peak_at": repetition.peak_s,
        **{name: np.nan if one.value is None else one.value for name, one in found.items()},
        **{f"coverage_{name}": one.coverage for name, one in found.items()},
        "withheld": "; ".join(reasons),
    }
