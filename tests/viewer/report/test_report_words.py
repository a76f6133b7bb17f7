"""What a report says of a calibration and of names, in words with units, in both languages."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import pytest

from brachium_viewer import figures as f
from brachium_viewer import marks
from brachium_viewer.catalogue import catalogue
from brachium_viewer.contents import Contents, SensorContents
from brachium_viewer.exercises import exercise
from brachium_viewer.report import page, sentences, words
from brachium_viewer.report import report_tables as tables
from brachium_viewer.report.groups import groups
from brachium_viewer.sessions.from_recording import session_from_recording
from brachium_wire.messages import Calibration, Info, Session
from brachium_wire.sequence import SequenceCounter


def report_of(calibration: Calibration) -> Any:
    contents = SimpleNamespace(calibrations={"p01": calibration}, arms={})
    return SimpleNamespace(session=SimpleNamespace(subject="p01"), contents=contents)


def test_of_a_calibrations_scores_the_worst_are_told_in_one_line() -> None:
    arms = [f"{segment}_{side}" for side in "rl" for segment in ("upper_arm", "forearm", "hand")]
    scores = {f"sway_deg_{segment}": 0.0124 + 0.001 * i for i, segment in enumerate(arms)}
    scores |= {f"from_nominal_deg_{segment}": 9.79 - i for i, segment in enumerate(arms)}
    said = sentences.how_zero_was_set(
        report_of(Calibration(time_ns=1, state="done", pose="n-pose", scores=scores))
    )
    assert said == (
        "Zero in pose n-pose. Forward not known: headings are assumed. Scores of the calibration: "
        "largest sway 0.02 deg (hand l), largest way off the stated mounting 9.8 deg (upper arm r)."
    )
    assert catalogue("de").told(said) == (
        "Nullpunkt in der Haltung (hängende Arme). Vorn nicht bekannt: Richtungen sind angenommen. Güte der "
        "Kalibrierung: größtes Schwanken 0,02° (Hand links), am weitesten neben dem vorgesehenen Sitz 9,8° "
        "(Oberarm rechts)."
    )


def test_a_score_that_no_reader_can_act_on_is_not_told() -> None:
    assert words.scores({"unexplained_share_r": 0.51234}) == []


@pytest.mark.parametrize(
    ("english", "german"),
    [
        ("Session of p01, 2026-11-22 18:33 UTC", "Sitzung von p01, 22.11.2026, 18:33 UTC"),
        ("deg; last session: 2026-11-20, 2026-11-22", "°; letzte Sitzung: 20.11.2026, 22.11.2026"),
        ("recording 2026-11-22.mcap", "Aufzeichnung 2026-11-22.mcap"),
    ],
)
def test_days_are_written_as_the_language_does(english: str, german: str) -> None:
    assert catalogue("de").told(english) == german


def test_an_exercise_that_no_table_holds_is_said_in_words() -> None:
    said = words.movement(exercise("stirring").name, "left")
    assert said == "free movement, left"
    assert catalogue("de").told(said) == "Freie Bewegung, links"


def test_a_sensor_that_delivered_nothing_has_no_share_lost() -> None:
    silent = SensorContents(info=Info(node="n1", rate_hz=100.0, origin="worn", host="h"))
    heard = SensorContents(counted=SequenceCounter(received=60, lost=40))
    contents = Contents(sensors={("p01", "forearm_r"): silent, ("p01", "hand_r"): heard})
    rows = tables.quality(f.segments(contents), {}, {}).rows
    assert rows == [
        ["forearm r", "n1", "none", tables.NONE, tables.NONE, tables.NONE],
        ["hand r", tables.NONE, "60", "40.00", "0", tables.NONE],
    ]
    assert catalogue("de").told("none") == "keine"


def test_how_far_estimated_lengths_put_places_off_is_told() -> None:
    def method(**said: Any) -> str:
        report = report_of(Calibration(time_ns=1, state="done"))
        report.contents.sessions, report.contents.fusion = {"p01": Session(**said)}, {}
        report.session.method = 1
        return sentences.method(report)[-1]

    of_height = method(height_m=1.8)
    assert "be off by 2.0, 2.4 and 2.6 cm" in of_height
    assert "um 2,0, 2,4 und 2,6 cm falsch" in catalogue("de").told(of_height)
    assert "not told" in method()
    measured = {"chest_to_shoulder": 0.2, "upper_arm": 0.3, "forearm": 0.25, "hand": 0.18}
    assert "AAOS reference" in method(lengths_m=measured)


def test_what_was_refused_or_left_out_is_told_first() -> None:
    refused = Calibration(
        time_ns=1, state="refused", reason="nobody stood still", refused={"elbow_r": "too little"}
    )
    report = report_of(refused)
    report.contents.warning, report.contents.unreadable = "not closed", {"malformed": 2, "wrong_type": 1}
    report.motions, report.groups = {}, [None]
    report.contents.clocks = {"p01": "the clock jumped"}
    assert sentences.warnings(report) == [
        "not closed",
        "calibration refused: nobody stood still",
        "elbow r not found: too little",
        "the clock jumped",
        "left out: 2 messages malformed, 1 message wrong_type",
    ]


@pytest.fixture(scope="module")
def told(scripts: Any, tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """The pages by language of one repetition, after which the patient stopped."""
    one = scripts.Script("p01")
    one.set(1, 90.0)
    one.mark(marks.PatientStop())
    one.now_s += 2.0
    one.mark(marks.PatientStop(reason="pain"))
    folder = tmp_path_factory.mktemp("told")
    settings = page.ReportSettings(recording=scripts.write(folder / "a.mcap", [one]), out=folder / "a.html")
    pages = {}
    for language in ("en", "de"):
        page.write(replace(settings, language=language))
        pages[language] = settings.out.read_text("utf-8")
    return pages


def test_one_repetition_is_said_as_one(told: dict[str, str]) -> None:
    assert "1 active repetition<" in told["en"]
    assert "1 aktiv (Wiederholung)" in told["de"]


def test_a_stop_between_sets_is_told_once_with_its_reason(told: dict[str, str]) -> None:
    assert told["en"].count("stopped by the patient between sets: pain") == 1
    assert told["en"].count("stopped by the patient") == 1
    assert "von der Person zwischen den Sätzen beendet: Schmerz" in told["de"]


def test_a_long_pseudonym_breaks() -> None:
    assert "h1 { font-size: 17pt; overflow-wrap: anywhere; }" in page.TEMPLATE.read_text("utf-8")


@pytest.mark.parametrize(("name", "tries"), [("elbow-flexion", "2"), ("drinking", tables.NONE)])
def test_tries_are_counted_where_one_rise_is_one_repetition(worn: Any, name: str, tries: str) -> None:
    one = session_from_recording(worn).sets[0]
    (group,) = groups([replace(one, measures=replace(one.measures, exercise=name, tries=2))])
    found = tables.done([group])
    assert dict(zip(found.head, found.rows[0], strict=False))["tries"] == tries
    assert ("A try is" in found.note) == (tries != tables.NONE)
