"""The report in another language: nothing of it stays English, and every line that it has is used."""

import html
import json
import re
from pathlib import Path
from typing import get_args

import pytest

import brachium_viewer
import brachium_wire
from brachium_body.segments import SEGMENTS
from brachium_viewer import catalogue as c
from brachium_viewer.exercises import EXERCISES, PLANES_DEG
from brachium_viewer.marks import Mode, When
from brachium_viewer.report import page, words
from brachium_viewer.report.language import in_language

VIEWER = Path(brachium_viewer.__file__).parent
SOURCES = [
    *sorted((VIEWER / "report").glob("*.py")),
    *(VIEWER / "metrics" / f"{name}.py" for name in ("measure", "medians", "both_arms")),
    *(VIEWER / "metrics" / f"{name}.py" for name in ("repetition_measures", "set_measures")),
    VIEWER / "page_template.py",
    *(Path(brachium_wire.__file__).parent / f"{name}.py" for name in ("reading", "steady_times")),
]
OTHERS = c.LANGUAGES[1:]
BLANK = re.compile(r"\{[^{}]*\}")
WORD = re.compile(r"[A-Za-z']+")
TEXT = re.compile(r"(?:>|%\}|^)([^<>{}]*[A-Za-z]{2}[^<>{}]*)(?:<|\{%|\{\{|$)", re.MULTILINE)
ENGLISH = {"the", "of", "is", "and", "not", "with", "by", "for", "to", "from", "are", "it", "or"}
PROGRAM = {
    "sets of one exercise by one arm in one mode can be taken together",  # of what a program does wrongly
    "a page needs Jinja2: pip install 'brachium[report]'",  # of what is not installed
    "a block's check sum is another",
    "a record is longer than its block",
    "the file ends with something else",
    "the file ends within a record",
    "{}: a recording cut before its first message; nothing can be read",
    "{}: an MCAP file of another program (profile {}), not a recording",
    "{}: not a recording (an MCAP file); made by: brachium record",  # of a file that gives no report
}
PARTS = {
    "Session of",
    "{} repeated donnings",  # of lines that are put together: MADE
    "free movement",  # has the pages' line
}
MADE = {
    "Session of {}, {}",
    "Session of {}",
    "{}:",  # of the template, around what is filled in
    *(f"{plane} {{}} to {{}}" for plane in PLANES_DEG),
    *PLANES_DEG,
    *(segment.replace("_", " ") for segment in SEGMENTS if segment != "sternum"),
    "shoulder rotation",
    "wrist deviation",
    "{} +{}",
    "{} -{}",  # of names and signs
    "n-pose",
    "table",
    "given",
    *(f"{{}} {mode}" for mode in get_args(Mode)),
    *(f"{{}} {when}" for when in get_args(When)),
    "{} (stated)",
    "{} ({} repeated donnings)",
}
"""Put together in code."""


def lines(language: str) -> dict[str, str]:
    return json.loads((c.REPORT / f"{language}.json").read_text("utf-8"))


def texts_of(page: str) -> list[str]:
    body = re.sub(r"<style.*?</style>", "", page, flags=re.DOTALL)
    return [html.unescape(text.strip()) for text in re.split(r"<[^>]*>", body) if text.strip()]


@pytest.fixture(scope="module")
def said(texts_in) -> set[str]:
    template = (VIEWER / "report" / "report.html.j2").read_text("utf-8")
    found = {text.strip() for path in SOURCES for text in texts_in(path)}
    return found | {
        text.strip() for text in TEXT.findall(re.sub(r"<style.*?</style>", "", template, flags=re.S))
    }


@pytest.mark.parametrize("language", OTHERS)
def test_each_sentence_has_its_line_and_no_line_is_of_what_no_report_says(check_lines, said, language):
    check_lines(lines(language), said, PROGRAM | PARTS, MADE)


@pytest.mark.parametrize("language", OTHERS)
def test_no_line_leaves_a_figure_out(language):
    for key, text in lines(language).items():
        assert sorted(BLANK.findall(text)) == sorted(BLANK.findall(key)), key


@pytest.mark.parametrize("language", OTHERS)
def test_nothing_of_a_report_stays_english(worn, emulated, tmp_path, language):
    for recording in (worn, emulated):
        out = tmp_path / f"{recording.stem}.html"
        page.write(page.ReportSettings(recording=recording, out=out, language=language))
        told = out.read_text("utf-8")
        assert f'<html lang="{language}">' in told
        left = [text for text in texts_of(told) if set(WORD.findall(text)) & ENGLISH]
        assert left == []


def test_a_report_in_german_says_the_same_as_the_english_one(worn, tmp_path):
    english, german = tmp_path / "en.html", tmp_path / "de.html"
    for out, language in ((english, "en"), (german, "de")):
        page.write(page.ReportSettings(recording=worn, out=out, language=language))
    ours, theirs = texts_of(english.read_text("utf-8")), texts_of(german.read_text("utf-8"))
    assert len(ours) == len(theirs)
    number = re.compile(r"\d+(?:[.,]\d+)?")
    for one, other in zip(ours, theirs, strict=True):
        if not re.search(r"\d{4}-", one):
            assert [n.replace(",", ".") for n in number.findall(other)] == number.findall(one), (one, other)
    assert "Ellbogenbeugung, rechts, aktiv gegen links" in theirs
    assert "Was fehlt, und warum" in theirs


def test_foreign_words_cannot_become_markup():
    told = '<html lang="en"><p>a &lt;b&gt; &amp; c</p><p>no goal was set</p></html>'
    assert in_language(told, "de") == (
        '<html lang="de"><p>a &lt;b&gt; &amp; c</p><p>kein Ziel war gesetzt</p></html>'
    )
    assert in_language(told, "en") == told


def test_another_language_is_refused_with_those_that_are_there():
    with pytest.raises(ValueError, match=r"'xx'.*en, de"):
        in_language("<p>x</p>", "xx")


@pytest.mark.parametrize(
    ("english", "german"),
    [
        ("only 55 % of it was measured", "nur 55 % davon wurden gemessen"),
        ("went in plane 12 deg, not in flexion (60 to 120)", "ging in der Ebene 12°, "
         "nicht in Flexion (60 bis 120)"),
        ("plane: the heading is assumed", "Ebene: die Richtung ist angenommen"),
        ("elbow r not found: too little movement: the elbow bent by 5 deg, at least 30 are needed; bend and "
         "straighten it", "elbow r nicht gefunden: Zu wenig Bewegung: Der Ellbogen beugte sich um 5°, "
         "mindestens 30° sind nötig; beugen und strecken"),
        ("range of motion, peak speed (reaching, left, assisted: 2 of 9); start (drinking, left, active)",
         "Bewegungsumfang, höchste Geschwindigkeit (Nach vorn greifen, links, unterstützt: 2 von 9); "
         "Anfang (Trinken, links, aktiv)"),
        ("-3.5 (85\N{NO-BREAK SPACE}%)", "-3,5 (85\N{NO-BREAK SPACE}%)"),
        ("/x/a.mcap: not closed: read up to the cut; 2 damaged blocks left out",
         "/x/a.mcap: nicht geschlossen: bis zum Abbruch gelesen; 2 beschädigte Blöcke ausgelassen"),
        ("left out: 3 messages malformed, 1 message wrong_type",
         "ausgelassen: 3 Nachrichten (malformed), 1 Nachricht (wrong_type)"),
        ("a node that is called to", "a node that is called to"),
    ],
)  # fmt: skip
def test_sentences_within_sentences(english, german):
    assert c.catalogue("de").told(english).replace("\u00ad", "") == german  # where words may be parted


def test_every_exercise_is_called_as_on_the_pages():
    pages = json.loads((c.PAGES / "de.json").read_text("utf-8"))
    for name in EXERCISES:
        english = words.exercise(name)
        assert c.catalogue("de").told(english) in (pages[f"exercise.{name}"], lines("de").get(english))
