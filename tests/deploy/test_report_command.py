"""The report and the sessions from the command line, on a session that was emulated and solved."""

import json
from itertools import islice
from pathlib import Path
from typing import Any

import pytest

from brachium import emulated_session
from brachium.__main__ import main
from brachium_viewer.contents import load
from brachium_wire.recording import RecordingWriter, read


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("session")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(emulated_session, "PLAN", emulated_session.PLAN[:1])
        emulated_session.write(folder / "p01.mcap", minutes=1.4)
    return folder / "p01.mcap"


def run(capsys: pytest.CaptureFixture[str], *words: str) -> Any:
    assert main([*words, "--json"]) == 0
    return json.loads(capsys.readouterr().out)


def test_an_emulated_session_is_a_recording_like_any(recording: Path) -> None:
    found = load(recording)
    assert found.unreadable == {}
    assert found.origins == ["emulated"]
    assert len(found.events["p01"]) == 3 * 2 + 4
    for sensor in found.sensors.values():
        assert sensor.status is not None
        assert 0 < sensor.counted.lost < 0.02 * sensor.counted.received
        assert sensor.status.lost <= sensor.counted.lost
    skeletons = found.arms["p01", "right"].published
    assert len(skeletons) > 0.98 * 1.4 * 60 * 50
    assert {s.origin for s in skeletons.examples} == {"emulated"}


def test_report_writes_its_page_and_its_table(
    recording: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    page, rows = tmp_path / "a.html", tmp_path / "a.csv"
    found = run(capsys, "report", str(recording), "--out", str(page), "--csv", str(rows))
    assert found["origin"] == "emulated"
    assert found["sets"] == 3
    assert found["repetitions"] >= 3
    assert page.stat().st_size == found["bytes"]
    lines = [line for line in rows.read_text().splitlines() if not line.startswith("#")]
    assert len(lines) == 1 + found["repetitions"]


def test_a_report_that_is_empty_says_why(
    recording: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], caplog: pytest.LogCaptureFixture
) -> None:
    unmarked = tmp_path / "unmarked.mcap"
    with RecordingWriter(unmarked) as file, read(recording) as messages:
        for key, payload, log_ns in islice(messages, 500):
            if not key.endswith(("/event", "/session")):
                file.write(key, payload, log_ns)
    found = run(capsys, "report", str(unmarked), "--out", str(tmp_path / "a.html"))
    assert found["sets"] == 0
    assert "no exercise was marked" in caplog.text


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--out", "a.pdf"], "ends in .html"),
        (["--out", "no/a.html"], "no folder"),
        (["--out", "a.html", "--exercise", "elbow-flexion"], "go together"),
        (["--out", "a.html", "--exercise", "dance", "--side", "left"], "not known"),
        (["--out", "a.html", "--sessions", "nowhere"], "no such folder"),
        (["--out", "a.html", "--subject", "p09"], "no 'p09'"),
    ],
)
def test_what_cannot_be_is_refused_in_one_line(
    recording: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    words: list[str],
    said: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["report", str(recording), *words]) == 2
    complaint = capsys.readouterr().err.strip().splitlines()
    assert said in complaint[-1]


def test_sessions_from_the_command_line(
    recording: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    one, two = ["--dir", str(tmp_path / "one")], ["--dir", str(tmp_path / "two")]
    number = run(capsys, "sessions", "add", str(recording), *one)["session"]
    listed = run(capsys, "sessions", "list", *one)
    assert listed["subjects"] == ["p01"]
    assert [s["origin"] for s in listed["sessions"]] == ["emulated"]
    assert len(run(capsys, "sessions", "show", str(number), *one)["sets"]) == 3
    packed = tmp_path / "p01.zip"
    assert run(capsys, "sessions", "export", "p01", "--out", str(packed), *one)["recordings"] == 1
    assert run(capsys, "sessions", "import", str(packed), *two)["sessions"] == 1
    assert main(["sessions", "delete", "p01", *one]) == 2
    assert "--yes" in capsys.readouterr().err
    run(capsys, "sessions", "delete", "p01", "--yes", *one)
    assert run(capsys, "sessions", "list", *one)["subjects"] == []
    assert not list((tmp_path / "one").glob("*.mcap"))
    assert main(["sessions", "list", *one]) == 0
    assert "nobody yet" in capsys.readouterr().out
