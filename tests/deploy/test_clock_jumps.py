"""Recordings in whose midst a clock was set, to a report, its table and exports: nothing good is lost."""

from itertools import pairwise
from pathlib import Path

import msgspec
import numpy as np
import pytest

from brachium.__main__ import main
from brachium_body.continuation import AngleTracker
from brachium_nodes.wearer import Wearer, WearerSettings
from brachium_viewer import marks
from brachium_viewer.figures import figures
from brachium_wire import keys, recording, table
from brachium_wire.codec import encode
from brachium_wire.messages import Skeleton

S = 10**9
START_NS = 1_700_000_000 * S
T = 4.0 + np.arange(1500) / 50.0
"""Thirty seconds of an emulated arm; the clock is set in their midst."""
MIDST_S = 19.0


@pytest.fixture(scope="module")
def skeletons() -> list[Skeleton]:
    wearer = Wearer(WearerSettings(exercise="elbow-flexion"))
    return list(wearer.skeletons(T, "right", START_NS, AngleTracker()))


def written(path: Path, skeletons: list[Skeleton], set_by_s: float, recorder_too: bool = False) -> Path:
    """Write them with the clock set by so much, the recorder's, too, or its alone running on."""
    with recording.RecordingWriter(path) as file:
        begins = marks.ExerciseBegins(exercise="elbow-flexion", side="right", goal_deg=60.0)
        first_ns = skeletons[0].time_ns
        file.write(keys.event("gym", "p01"), encode(marks.event(begins, first_ns)), first_ns)
        for one, t in zip(skeletons, T.tolist(), strict=True):
            jump_ns = round(set_by_s * S) if t >= MIDST_S else 0
            late_ns = one.time_ns + 30_000_000 + (jump_ns if recorder_too else 0)
            told = msgspec.structs.replace(one, time_ns=one.time_ns + jump_ns)
            file.write(keys.skeleton("gym", "p01", "right"), encode(told), late_ns)
    return path


def report(path: Path, folder: Path, *more: str) -> tuple[str, table.Table]:
    out, rows = folder / "a.html", folder / "a.csv"
    assert main(["report", str(path), "--out", str(out), "--csv", str(rows), *more]) == 0
    return out.read_text(encoding="utf-8"), table.read(rows)


@pytest.mark.parametrize("set_by_s", [-5.0, 86_400.0])
def test_by_when_each_came_all_is_as_if_no_clock_had_been_set(
    skeletons: list[Skeleton], set_by_s: float, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    (tmp_path / "right").mkdir()
    right = written(tmp_path / "right.mcap", skeletons, 0.0)
    page, rows = report(right, tmp_path / "right")
    assert "jumped" not in page + caplog.text
    wrong = written(tmp_path / "wrong.mcap", skeletons, set_by_s)
    assert "the clock of fusion jumped by" in figures(wrong).warning
    assert figures(right).warning == ""
    for language, said in (("en", "the clock of fusion jumped by"), ("de", "die Uhr der Fusion sprang um")):
        page, found = report(wrong, tmp_path, "--language", language)
        assert page.count(said) == 1
        assert len(found) == len(rows) >= 4
        for name, unit in rows.units.items():
            if unit:
                np.testing.assert_allclose(found.columns[name], rows.columns[name], atol=1e-6, err_msg=name)
    assert caplog.text.count("jumped by") == 2
    for to in ("csv", "mot"):
        for source in (right, wrong):
            assert main(["export", str(source), "--out", str(tmp_path / f"{source.stem}.{to}")]) == 0
        assert (tmp_path / f"wrong.{to}").stat().st_size == pytest.approx(
            (tmp_path / f"right.{to}").stat().st_size, rel=0.01
        )
    assert caplog.text.count("jumped by") == 4


@pytest.mark.parametrize("set_by_s", [-30.0, 600.0, 31_536_000.0])
def test_where_the_recorders_clock_was_set_too_what_can_be_said_is(
    skeletons: list[Skeleton],
    set_by_s: float,
    tmp_path: Path,
    caplog: pytest.LogCaptureFixture,
    capsys: pytest.CaptureFixture[str],
) -> None:
    wrong = written(tmp_path / "wrong.mcap", skeletons, set_by_s, recorder_too=True)
    page, rows = report(wrong, tmp_path)
    assert len(rows) >= 2
    assert (rows.columns["peak_speed"][np.isfinite(rows.columns["peak_speed"])] > 10.0).all()
    assert all(a < b for a, b in pairwise(rows.columns["from"].tolist()))
    out = tmp_path / "wrong.mot"
    done = main(["export", str(wrong), "--out", str(out)])
    if set_by_s < 0.0:
        assert "left out as their time had gone back: 750 skeletons" in page + caplog.text
        assert done == 0
    elif set_by_s < 1000.0:
        assert done == 0
    else:
        assert done == 2
        error = capsys.readouterr().err + caplog.text
        (line,) = [one for one in error.splitlines() if "even grid" in one]
        assert "nothing is known from 14.98 s" in line
        until, later = line.split("--until ")[1].split(",")[0], line.split("--from ")[1].split()[0]
        for option, value in (("--until", until), ("--from", later)):
            assert main(["export", str(wrong), "--out", str(out), option, value]) == 0
            assert out.read_text().count("\n") > 740
