"""Each dash of a report has its reason, and what a median leaves out is told."""

import re
from pathlib import Path
from typing import Any

import pytest

from brachium_viewer.catalogue import catalogue
from brachium_viewer.metrics.measure import measure
from brachium_viewer.metrics.measure import withheld as no_measure
from brachium_viewer.report import page
from brachium_viewer.report.groups import groups, lags, symmetries
from brachium_viewer.report.withheld import LAST_BESIDE_FIRST, withheld
from brachium_viewer.sessions.from_recording import session_from_recording


def told(scripts: Any, folder: Path, **qualities: Any) -> tuple[str, list[str]]:
    """Return the page of both arms' sets of two, and what it withholds."""
    one = scripts.Script("p01")
    one.set(6, 90.0, goal_deg=100.0)
    one.set(2, 95.0, mode="passive")
    one.mark(scripts.marks.ExerciseBegins(exercise="elbow-flexion", side="left"))
    one.move(4, 90.0, "left", **qualities)
    one.mark(scripts.marks.ExerciseEnds())
    out = folder / "a.html"
    page.write(page.ReportSettings(recording=scripts.write(folder / "a.mcap", [one]), out=out))
    text = out.read_text("utf-8")
    return text, re.findall(r"<li><strong>(.*?):</strong> (.*?)</li>", text)


def test_every_dash_has_its_reason(scripts: Any, tmp_path: Path) -> None:
    _, found = told(scripts, tmp_path, assumed={"elbow_flexion": "assumed"})
    reasons = dict(found)
    unmeasured = reasons["the angle rests on an assumption"]
    assert "range of motion" in unmeasured
    assert "short of straight" in unmeasured
    for word in ("hand path", "translation", "trunk lean"):
        assert word not in unmeasured
    assert "trunk lean" in reasons["a sensor on the sternum gives it"]
    assert "hand path" in reasons["no repetition"]
    both = reasons["one side is not known: the angle rests on an assumption"]
    assert "both arms: range of motion" in both
    assert "both arms: difference of LDLJ" in both


def test_a_goal_that_was_not_reached_is_a_result(scripts: Any, tmp_path: Path) -> None:
    text, found = told(scripts, tmp_path)
    assert "<td>not reached</td>" in text
    assert "the goal was not reached" not in {why for why, _ in found}


def test_what_is_known_of_most_repetitions_says_of_how_many_it_is_not(worn: Path) -> None:
    session = session_from_recording(worn)
    every = groups(session.sets)
    spoilt = every[0].pooled.repetitions[0].measures
    for name in ("range", "peak"):
        spoilt[name] = no_measure("samples were lost", "deg")
    again = groups(session.sets)
    lines = dict(withheld(again, symmetries(again, "right"), lags(again), []))
    assert "range of motion (elbow flexion, right: 1 of 10)" in lines["samples were lost"]
    assert again[0].pooled.medians["range"].coverage == pytest.approx(0.9)


def test_a_row_that_is_shown_has_a_reason_for_each_of_its_dashes(worn: Path) -> None:
    session = session_from_recording(worn)
    for one in groups(session.sets)[0].pooled.repetitions[-2:]:
        one.measures["range"] = no_measure("a gap", "deg")
    again = groups(session.sets)
    change = again[0].pooled.first_to_last
    assert change["range"].value is None
    assert any(change[name].value is not None for name in LAST_BESIDE_FIRST)
    assert ("known in 5 of the first 5 and 3 of the last", "last 5 beside the first: range of motion") in [
        (why, what.split(" (")[0]) for why, what in withheld(again)
    ]


def test_components_that_are_not_there_are_told(worn: Path) -> None:
    every = groups(session_from_recording(worn).sets)
    lines = dict(withheld(every, parts=[(every[0], None)]))
    assert lines["fewer than two joint angles were measured and moved"].startswith("components (elbow")


def test_a_reason_that_differs_in_its_numbers_alone_is_told_once(worn: Path) -> None:
    session = session_from_recording(worn)
    gaps = ["0.12", "0.3", "0.14", *[""] * 7]
    for one, gap in zip(groups(session.sets)[0].pooled.repetitions, gaps, strict=True):
        for name in ("sparc", "ldlj"):
            why = f"a gap of {gap} s in the way there may hide a jerk"
            one.measures[name] = no_measure(why, "1") if gap else measure(-1.4, "1")
    lines = [one for one in withheld(groups(session.sets)) if "may hide a jerk" in one[0]]
    assert lines == [
        (
            "a gap of 0.12 to 0.3 s in the way there may hide a jerk",
            "smoothness SPARC, smoothness LDLJ (elbow flexion, right: 3 of 10)",
        )
    ]
    assert catalogue("de").told(f"{lines[0][0]}:") == (
        "eine Lücke von 0,12 bis 0,3 s im Hinweg kann einen Ruck verbergen:"
    )
