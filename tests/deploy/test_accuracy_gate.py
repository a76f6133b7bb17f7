"""Accuracy may not get worse unseen. After a change that betters it, or is worth what it costs:

brachium evaluate --gate --out tests/golden/accuracy.json
"""

import json
from pathlib import Path

from brachium.evaluation import gate

GOLDEN = Path(__file__).parents[1] / "golden" / "accuracy.json"


def test_no_figure_is_more_than_a_tenth_worse_than_stored():
    stored = json.loads(GOLDEN.read_text("utf-8"))
    now = gate.figures()
    assert len(stored) >= 20
    assert sorted(now) == sorted(stored), "other figures than stored: remake tests/golden/accuracy.json"
    assert gate.worse(now, stored) == []


def test_worse_and_missing_figures_are_named():
    stored = {"a": 1.0, "b": 2.0, "c": 3.0}
    assert gate.worse({"a": 1.09, "b": 2.0, "c": 0.1}, stored) == []
    assert gate.worse({"a": 1.2, "b": float("nan")}, stored) == [
        "a: was 1, is 1.2",
        "b: was 2, is nan",
        "c: was 3, is not there",
    ]
