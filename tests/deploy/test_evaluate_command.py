import json
from pathlib import Path

import pytest

from brachium.__main__ import main
from brachium.evaluation.catalogue import CATALOGUE, find


def test_every_table_has_its_own_name():
    assert len({entry.name for entry in CATALOGUE}) == len(CATALOGUE)
    assert find([]) == CATALOGUE
    assert [entry.name for entry in find(["zhou", "arm"])] == ["arm", "zhou"]


def test_tables_are_listed(capsys: pytest.CaptureFixture[str]):
    assert main(["evaluate", "--list"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines] == [entry.name for entry in CATALOGUE]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--table", "nothing"], "table 'nothing' is not known; there are broad"),
        (["--level", "perfect"], "--level 'perfect' is not known; choose of exact"),
        (["--data", "nowhere"], "--data nowhere: no such folder"),
    ],
)
def test_what_is_not_known_is_named(words: list[str], said: str, capsys: pytest.CaptureFixture[str]):
    assert main(["evaluate", *words]) == 2
    assert said in capsys.readouterr().err


def test_recordings_are_left_out_where_there_are_none(capsys: pytest.CaptureFixture[str]):
    assert main(["evaluate", "--table", "broad", "--json"]) == 0
    captured = capsys.readouterr()
    assert json.loads(captured.out)["tables"] == {}
    assert "broad: left out, it needs recordings (give --data)" in captured.err


def test_a_table_is_printed_and_written_as_text_page_and_json(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    words = [
        "evaluate",
        "--quick",
        "--level",
        "ideal",
        "--table",
        "zhou-errata",
        "--out",
        str(tmp_path / "t"),
    ]
    assert main([*words, "--json"]) == 0
    table = json.loads(capsys.readouterr().out)["tables"]["zhou-errata"]
    assert json.loads((tmp_path / "t").read_text()) == {"seeds": [1], "tables": {"zhou-errata": table}}
    rows = {row["label"]: row for row in table["rows"]}
    worst, best = rows["printed"], rows["corrected"]
    assert all(worst[column] > best[column] for column in table["columns"])
    assert best["shrug: shoulder"] < 8.0
    assert rows["corrected, drift left in"]["shrug: shoulder"] > 50.0
    assert main([*words, "--markdown"]) == 0
    assert capsys.readouterr().out.startswith("### The system of Zhou et al. 2008")
