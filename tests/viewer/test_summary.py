"""The page: whole in itself, plain about its origin, and showing the figures it was given."""

import importlib.util
import re
from html.parser import HTMLParser
from pathlib import Path
from types import ModuleType
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest

from brachium_viewer import charts, contents, figures, summary
from brachium_wire import keys, recording
from brachium_wire.codec import encode
from brachium_wire.messages import Calibration, Info


def _neighbour(name: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location(name, Path(__file__).with_name(f"{name}.py"))
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


record: Any = _neighbour("test_figures").record


class Page(HTMLParser):
    """Collects the page's words and everything that could load or run something."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags: list[str] = []
        self.words: list[str] = []
        self.references: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        for name, value in attrs:
            if name in ("src", "href", "xlink:href", "srcset", "action", "data") or name.startswith("on"):
                self.references.append(value or "")
            if value and "url(" in value:
                self.references += re.findall(r"url\(([^)]*)\)", value)

    def handle_data(self, data: str) -> None:
        if self.tags and self.tags[-1] != "style" and data.strip():
            self.words.append(data.strip())


@pytest.fixture
def made(tmp_path: Path) -> tuple[str, figures.SummaryFigures]:
    record(tmp_path / "a.mcap")
    found = summary.write(tmp_path / "a.mcap", tmp_path / "a.html")
    return (tmp_path / "a.html").read_text(encoding="utf-8"), found


def test_the_page_loads_and_runs_nothing(made: tuple[str, figures.SummaryFigures]) -> None:
    page = Page(made[0])
    assert "script" not in page.tags
    assert not set(page.tags) & {"link", "iframe", "img", "object", "embed", "form", "base"}
    assert all(reference.startswith("#") for reference in page.references)
    assert page.references
    ids = re.findall(r'\bid="([^"]*)"', made[0])
    assert len(ids) == len(set(ids))
    assert {reference[1:] for reference in page.references} <= set(ids)


def test_it_says_what_it_is_and_what_it_is_not(made: tuple[str, figures.SummaryFigures]) -> None:
    text = " ".join(Page(made[0]).words)
    assert "Emulated. No person wore these sensors" in text
    assert "not a medical device" in text
    assert "p01: heading assumed" in text
    assert "exercise: reaching" in text
    for word in ("normal", "improved", "clinically valid"):
        assert word not in text


def test_its_figures_are_those_returned(made: tuple[str, figures.SummaryFigures]) -> None:
    text, found = " ".join(Page(made[0]).words), made[1]
    arm = found.arms["p01/right"]
    assert f"RMSE {arm.angles_deg['elbow_flexion'].rmse:.1f}°" in text
    assert f"{arm.positions_mm['hand'].rmse:.0f} mm" in text
    assert "400 of 500 skeletons compared" in text
    assert "compared where the true elevation is 20° or more" in text
    assert "n-hand_r" in text


def test_every_chart_is_drawing_that_parses(made: tuple[str, figures.SummaryFigures]) -> None:
    drawings = re.findall(r"<svg.*?</svg>", made[0], flags=re.DOTALL)
    assert len(drawings) == 2 + 1 + 2  # elbow and rotation, the fingertip's distance, latency, loss
    for drawing in drawings:
        root = ElementTree.fromstring(drawing)
        assert root.get("viewBox")
        assert len(list(root.iter())) > 10


@pytest.mark.parametrize(
    ("origins", "said"),
    [
        (["worn"], "Worn."),
        (["playback"], "Playback."),
        (["emulated", "worn"], "Mixed: emulated, worn."),
        ([], "unknown"),
    ],
)
def test_every_origin_is_shown_plainly(tmp_path: Path, origins: list[Any], said: str) -> None:
    with recording.RecordingWriter(tmp_path / "a.mcap") as writer:
        for i, origin in enumerate(origins):
            info = Info(node="n", rate_hz=100.0, origin=origin, host="h")
            writer.write(keys.info("gym", "p01", ("hand_r", "hand_l")[i]), encode(info), i)
    summary.write(tmp_path / "a.mcap", tmp_path / "a.html")
    assert said in " ".join(Page((tmp_path / "a.html").read_text()).words)


def test_foreign_words_cannot_become_markup(tmp_path: Path) -> None:
    with recording.RecordingWriter(tmp_path / "a.mcap") as writer:
        info = Info(node="<script>alert(1)</script>", rate_hz=100.0, origin="worn", host="h")
        writer.write(keys.info("gym", "p01", "hand_r"), encode(info), 1)
        bad = Calibration(time_ns=1, state="refused", reason="<img src=x onerror=alert(1)>")
        writer.write(keys.calibration("gym", "p01"), encode(bad), 2)
    summary.write(tmp_path / "a.mcap", tmp_path / "a.html")
    page = Page((tmp_path / "a.html").read_text())
    assert "script" not in page.tags
    assert "img" not in page.tags
    assert any("<script>" in word for word in page.words)


def test_a_recording_of_nothing_and_one_that_was_cut_have_pages(tmp_path: Path) -> None:
    with recording.RecordingWriter(tmp_path / "empty.mcap"):
        pass
    summary.write(tmp_path / "empty.mcap", tmp_path / "a.html")
    assert "holds no sensors" in (tmp_path / "a.html").read_text()
    record(tmp_path / "a.mcap")
    content = (tmp_path / "a.mcap").read_bytes()
    (tmp_path / "cut.mcap").write_bytes(content[: len(content) * 2 // 3])
    found = summary.write(tmp_path / "cut.mcap", tmp_path / "b.html")
    assert "not closed: read up to the cut" in (tmp_path / "b.html").read_text()
    assert 0 < found.arms["p01/right"].skeletons < 500


def test_a_thinned_line_keeps_its_peaks_and_its_gaps() -> None:
    time = np.arange(20_000) / 50
    values = np.sin(time)
    values[7_001], values[12_345], values[15_000:15_400] = 9.0, -9.0, np.nan
    t, v = charts.thinned(time, values)
    assert len(t) <= 1.6 * charts.POINTS
    assert np.nanmax(v) == 9.0
    assert np.nanmin(v) == -9.0
    assert np.isnan(v).any()
    assert (np.diff(t) > 0).all()
    assert set(t) <= set(time)


def test_a_hole_in_time_is_a_hole_in_the_line() -> None:
    time = np.array([0.0, 0.1, 0.2, 5.0, 5.1])
    t, v = charts.with_gaps(time, np.ones(5))
    assert np.flatnonzero(np.isnan(v)).tolist() == [3]
    assert t.tolist() == [0.0, 0.1, 0.2, 0.2, 5.0, 5.1]


def test_contents_count_each_arm_and_sensor_once(tmp_path: Path) -> None:
    record(tmp_path / "a.mcap", seconds=2.0)
    found = contents.load(tmp_path / "a.mcap")
    assert list(found.arms) == [("p01", "right")]
    assert len(found.sensors) == 3
    assert len(found.arms["p01", "right"].true) == 100
