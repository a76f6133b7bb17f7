"""The report on paper, printed by a real browser: whatever was done, nothing falls off the sheet."""

import re
from dataclasses import replace

import pytest
from pypdf import PdfReader

from brachium.bench_report import print_page
from brachium_viewer.contents import load
from brachium_viewer.exercises import EXERCISES
from brachium_viewer.report import page
from brachium_viewer.report.build import build
from brachium_viewer.report.measure_tables import measures
from brachium_viewer.sessions import from_recording as sessions

LEAST_POINTS = 7.5
"""Of what a table says, on paper."""
WORST = "p" + "seudonym-without-a-place-to-break" * 3


EVERYTHING = [
    (name, side, mode)
    for name in list(EXERCISES)[:9]
    for side in ("right", "left")
    for mode in ("active", "assisted")
]
USUAL = [
    ("elbow-flexion", "right", "active"),
    ("elbow-flexion", "right", "passive"),
    ("elbow-flexion", "left", "active"),
    ("shoulder-abduction", "right", "active"),
    ("wrist-flexion", "right", "active"),
    ("drinking", "right", "active"),
]
"""Of twenty minutes."""
SHEETS = 3


def session_of(worn, whats):
    """Return a session in which all this was done."""
    contents = load(worn)
    motions = sessions.motions(contents, "p01")
    session = sessions.session(contents, "worn.mcap", "p01", motions, None)
    (one,) = [s for s in session.sets if s.what == ("elbow-flexion", "right", "passive")]
    sets = [
        replace(one, measures=replace(one.measures, exercise=name, side=side, mode=mode))
        for name, side, mode in whats
    ]
    return build(contents, replace(session, sets=tuple(sets)), motions, lambda *_: ())


def _long(pooled):
    """Return measures whose numbers are as long as they get."""
    medians = {
        name: replace(m, value=-100.0 - i if m.unit in ("deg", "deg/s") else -10.0 - i, coverage=0.85)
        for i, (name, m) in enumerate(pooled.medians.items())
    }
    return replace(pooled, medians=medians)


@pytest.fixture(scope="module", params=["en", "de"])
def printed(request, worn, browser, tmp_path_factory):
    report = session_of(worn, EVERYTHING)
    report = replace(report, groups=[replace(g, pooled=_long(g.pooled)) for g in report.groups])
    folder = tmp_path_factory.mktemp("printed")
    shown = folder / "report.html"
    text = page.page(report, request.param).replace("p01</h1>", f"{WORST}</h1>")
    shown.write_text(text, encoding="utf-8")
    broken = print_page(browser, shown, folder / "report.pdf")
    return report, broken, PdfReader(folder / "report.pdf").pages


def test_nothing_is_wider_than_the_sheet(printed):
    _, broken, _ = printed
    assert broken == []


def test_every_number_of_the_measures_is_printed(printed):
    report, _, pages = printed
    paper = " ".join(page.extract_text() for page in pages).replace(",", ".")
    cells = [cell for table in measures(report.groups) for row in table.rows for cell in row[1:]]
    wanted = {cell for cell in cells if re.fullmatch(r"-\d+(\.\d+)? \(85\s%\)", cell)}
    assert len(wanted) == 14
    for cell in wanted:
        value = cell.split()[0].removeprefix("-")
        assert len(re.findall(rf"[-−]{re.escape(value)}\s\(85\s%\)", paper)) >= len(report.groups), cell


def test_what_tables_say_can_be_read(printed):
    _, _, pages = printed
    sizes = set()

    def seen(text, user, place, _font, size):
        if "(85" in text:
            sizes.add(round(size * abs(place[3]) * abs(user[3]), 1))

    for one in pages:
        one.extract_text(visitor_text=seen)
    assert sizes
    assert min(sizes) >= LEAST_POINTS


@pytest.mark.parametrize("language", ["en", "de"])
def test_a_usual_session_is_on_few_sheets(worn, browser, tmp_path, language):
    shown = tmp_path / "report.html"
    shown.write_text(page.page(session_of(worn, USUAL), language), encoding="utf-8")
    assert print_page(browser, shown, tmp_path / "report.pdf") == []
    assert len(PdfReader(tmp_path / "report.pdf").pages) <= SHEETS
