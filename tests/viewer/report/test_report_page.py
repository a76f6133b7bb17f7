"""The report: whole in itself, plain about what it is of, and calling a change only what is one."""

import re
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from brachium_viewer.marks import ExerciseBegins
from brachium_viewer.metrics.change import STATED_SDC_DEG
from brachium_viewer.report import page
from brachium_viewer.report.words import DISCLAIMER
from brachium_viewer.sessions.from_recording import session_from_recording
from brachium_viewer.sessions.records import METHOD, SessionRecord, StoreError, Subject
from brachium_viewer.sessions.store import Store
from brachium_wire import keys, recording, table

VOID = {"meta", "br", "link", "img", "input", "hr"}


class Page(HTMLParser):
    """Collects words and all that could load or run something, and holds that every tag is closed."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.tags: set[str] = set()
        self.words: list[str] = []
        self.references: list[str] = []
        self.feed(text)
        assert self.open == []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.add(tag)
        if tag not in VOID:
            self.open.append(tag)
        for name, value in attrs:
            assert not name.startswith("on"), name
            if name in ("src", "href", "xlink:href", "srcset", "action", "data"):
                self.references.append(value or "")
            if value and "url(" in value:
                self.references += re.findall(r"url\(([^)]*)\)", value)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.handle_starttag(tag, attrs)
        if tag not in VOID:
            self.open.pop()

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        if "style" not in self.open and data.strip():
            self.words.append(data.strip())

    @property
    def text(self) -> str:
        return " ".join(self.words)


def written(recording: Path, folder: Path, **more: object) -> tuple[Page, str, page.ReportFigures]:
    out = folder / "report.html"
    found = page.write(page.ReportSettings(recording=recording, out=out, **more))  # type: ignore[arg-type]
    text = out.read_text(encoding="utf-8")
    return Page(text), text, found


@pytest.fixture(scope="module")
def of_worn(worn: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[Page, str, page.ReportFigures]:
    return written(worn, tmp_path_factory.mktemp("page"))


def test_it_loads_and_runs_nothing(of_worn: tuple[Page, str, page.ReportFigures]) -> None:
    shown, text, found = of_worn
    assert not shown.tags & {"script", "link", "iframe", "img", "object", "embed", "form", "base"}
    assert all(reference.startswith("#") for reference in shown.references)
    assert not re.findall(r"https?://(?!www\.w3\.org/)", text)
    ids = re.findall(r'\bid="([^"]*)"', text)
    assert len(ids) == len(set(ids))
    assert {reference[1:] for reference in shown.references} <= set(ids)
    assert found.bytes == len(text.encode())


def test_every_figure_is_drawing_with_lines_in_it(of_worn: tuple[Page, str, page.ReportFigures]) -> None:
    drawings = re.findall(r"<svg.*?</svg>", of_worn[1], flags=re.DOTALL)
    assert len(drawings) == 3  # ranges, right elbow, left elbow; the wrist was not measured
    for drawing in drawings:
        root = ElementTree.fromstring(drawing)
        assert root.get("viewBox")
        long = [p for p in root.iter("{http://www.w3.org/2000/svg}path") if p.get("d", "").count("L") >= 3]
        assert len(long) >= 4
        assert "nan" not in drawing.lower().replace("nano", "")


def test_it_tells_what_was_done_and_what_it_is_not(of_worn: tuple[Page, str, page.ReportFigures]) -> None:
    text, found = of_worn[0].text, of_worn[2]
    assert (found.origin, found.sets, found.repetitions) == ("worn", 5, 14)
    for said in (
        "Session of p01",
        "elbow flexion, right active 2 10 of 10",
        "pain (0 to 10): 2 before, 5 after",
        "effort (0 to 10): 1 before",
        "Zero in pose n-pose",
        "their axis points to the right",
        "heading drifts",
        "limit 100 deg: passed in 2 of 2",
        "stopped by the patient: dizzy",
        "shoulder or trunk movement",
        "AAOS reference",
        "The way there begins where the speed, of the angle up to 1.6 Hz, last rises past 5 % of its peak",
        "mean speed, how far the angle went over that time",
        "where an exercise lowers its angle, the farthest is the lowest",
        "hold at the farthest point",
        "SPARC up to 10 Hz",
        "LDLJ of its speed at 100 Hz",
        "abduction -30 to 30",
        f"method {METHOD}",
        "No earlier session",
        DISCLAIMER,
    ):
        assert said in text, said
    for word in ("improved", "clinically valid", "normal", "\N{UPWARDS ARROW}", "\N{RIGHTWARDS ARROW}"):
        assert word not in text, word


def test_what_is_withheld_has_its_reason(of_worn: tuple[Page, str, page.ReportFigures]) -> None:
    text = of_worn[0].text
    assert "a sensor on the sternum gives it: trunk lean" in text
    assert "the sensor was not there:" in text  # of the wrist


@pytest.mark.parametrize(
    ("earlier_deg", "said"), [(100.0 - 0.8 * STATED_SDC_DEG, False), (100.0 - 2.0 * STATED_SDC_DEG, True)]
)
def test_a_change_is_shown_only_beyond_the_smallest_detectable_one(
    worn: Path, tmp_path: Path, earlier_deg: float, said: bool
) -> None:
    with Store.open(tmp_path / "store") as store:
        store.put_subject(Subject(pseudonym="p01", affected_side="left"))
        store.add(earlier(worn, earlier_deg))
    shown, _, found = written(worn, tmp_path, sessions=tmp_path / "store")
    assert found.compared == 3
    assert ("+20 deg" in shown.text) == said
    assert shown.text.count("within measurement error") == 1 + (0 if said else 6)  # one of active and passive
    assert found.changed == (6 if said else 0)
    assert "10 (stated)" in shown.text
    assert "affected side: left" in shown.text
    assert "elbow flexion, left, active over right" in shown.text


def earlier(worn: Path, top_deg: float, days: int = 1) -> SessionRecord:
    """Return the session of some days before in which every repetition went so much less far."""
    session = session_from_recording(worn)
    sets = []
    for one in session.sets:
        repetitions = tuple(
            replace(
                r,
                measures={
                    name: replace(m, value=m.value - (100.0 - top_deg))
                    if m.value is not None and name in ("range", "peak")
                    else m
                    for name, m in r.measures.items()
                },
            )
            for r in one.measures.repetitions
        )
        sets.append(replace(one, measures=replace(one.measures, repetitions=repetitions)))
    return replace(
        session, started_ns=session.started_ns - days * 86_400 * 10**9, sets=tuple(sets), recording=""
    )


def test_what_nobody_wore_says_so_and_stands_beside_nothing(
    worn: Path, emulated: Path, tmp_path: Path
) -> None:
    with Store.open(tmp_path / "store") as store:
        store.add(earlier(worn, 50.0))
    shown, text, found = written(emulated, tmp_path, sessions=tmp_path / "store")
    assert (found.origin, found.compared) == ("emulated", 0)
    assert "Emulated. No person wore these sensors" in shown.text
    assert 'class="origin loud"' in text
    assert "what nobody wore is kept out of a person's history" in shown.text


def test_a_last_session_by_another_method_is_not_compared(worn: Path, tmp_path: Path) -> None:
    with Store.open(tmp_path / "store") as store:
        store.add(replace(earlier(worn, 50.0), method=METHOD + 1))
    shown, _, found = written(worn, tmp_path, sessions=tmp_path / "store")
    assert found.compared == 0
    assert "another method" in shown.text


def withheld(session: SessionRecord) -> SessionRecord:
    """Return a session of which nothing can be compared."""
    sets = []
    for one in session.sets:
        repetitions = tuple(
            replace(
                r, measures={n: replace(m, value=None, withheld="off plane") for n, m in r.measures.items()}
            )
            for r in one.measures.repetitions
        )
        sets.append(replace(one, measures=replace(one.measures, repetitions=repetitions)))
    return replace(session, sets=tuple(sets))


def test_a_session_that_withholds_its_range_gives_way_to_the_one_before(worn: Path, tmp_path: Path) -> None:
    with Store.open(tmp_path / "store") as store:
        store.add(withheld(earlier(worn, 50.0)))
    shown, _, found = written(worn, tmp_path, sessions=tmp_path / "store")
    assert found.compared == 0
    assert "what could be compared is withheld here or there" in shown.text
    with Store.open(tmp_path / "store") as store:
        store.add(earlier(worn, 50.0, days=2))
    shown, _, found = written(worn, tmp_path, sessions=tmp_path / "store")
    assert found.compared > 0
    assert "withheld here or there" not in shown.text


def test_the_table_has_the_same_numbers_a_row_a_repetition(worn: Path, tmp_path: Path) -> None:
    written(worn, tmp_path, csv=tmp_path / "a.csv")
    found = table.read(tmp_path / "a.csv")
    assert set(found.columns["path_of"]) == {"hand"}
    session = session_from_recording(worn)
    repetitions = [(s, r) for s in session.sets for r in s.measures.repetitions]
    assert len(found) == len(repetitions) == 14
    assert found.units["range"] == "deg"
    ranges = [r.measures["range"].value for _, r in repetitions]
    assert found.columns["range"].tolist() == pytest.approx(ranges)
    assert found.columns["mode"].tolist() == [s.what[2] for s, _ in repetitions]
    assert np.isnan(found.columns["trunk_lean"]).all()
    assert all("trunk_lean: a sensor on the sternum gives it" in x for x in found.columns["withheld"])
    assert found.metadata["sparc_cutoff_hz"] == 10.0
    assert ",," in (tmp_path / "a.csv").read_text()


def test_a_recording_without_marks_says_how_to_name_the_exercise(tmp_path: Path, worn: Path) -> None:
    with recording.read(worn) as reading, recording.RecordingWriter(tmp_path / "a.mcap") as writer:
        for message in reading:
            if keys.parse(message.key).topic != "event":
                writer.write(*message)
    shown, _, found = written(tmp_path / "a.mcap", tmp_path)
    assert found.sets == 0
    assert "name it with --exercise and --side" in shown.text
    told = ExerciseBegins(exercise="elbow-flexion", side="right")
    with pytest.raises(StoreError, match=r"marked in it .*name no exercise"):
        written(worn, tmp_path, without_marks=told)
    shown, _, found = written(tmp_path / "a.mcap", tmp_path, without_marks=told)
    assert found.repetitions >= 10
