import json
from pathlib import Path

import pytest

from brachium.__main__ import COMMANDS
from brachium.commands import prove
from brachium.promises import PROOFS
from brachium.proofs import Promise, Proof


def promise(at_most: float | None) -> Promise:
    return Promise(name="n", unit="s", take=lambda figures: figures.get("n"), at_most=at_most)


@pytest.mark.parametrize(
    ("raw", "at_most", "kept"),
    [({"n": 1.0}, 2.0, True), ({"n": 2.0}, 2.0, True), ({"n": 2.1}, 2.0, False), ({"n": 9.0}, None, None)],
)
def test_a_figure_is_kept_up_to_its_target(raw: dict[str, float], at_most: float | None, kept: bool | None):
    assert prove.measured(promise(at_most), raw).kept is kept


@pytest.mark.parametrize("raw", [{}, [], None, {"n": None}, {"n": float("nan")}])
def test_a_figure_that_is_not_there_is_not_kept(raw: object):
    assert prove.measured(promise(1.0), raw).kept is False


def test_every_proof_is_one_of_our_commands_and_has_its_own_file():
    assert len({proof.name for proof in PROOFS}) == len(PROOFS)
    for proof in PROOFS:
        assert proof.promises
        assert all(command[0] in COMMANDS for command in proof.commands)
        assert "--json" in proof.commands[-1]


def test_takes_find_what_the_demo_says():
    (proof,) = (p for p in PROOFS if p.name == "demo-typical")
    counts = {"received": 9, "sent": 10, "lost": 3, "injected_lost": 1, "out_of_order": 0}
    arm = {
        "rmse_deg": {"elbow_flexion": 1.5},
        "rmse_mm": {"wrist": 7.0},
        "rate_hz": 50.0,
        "latency_p99_ms": 9.0,
    }
    raw = {
        "segments": {"a": {**counts, "injected_out_of_order": 0}},
        "arms": {"p01/right": arm},
        "first_skeleton_s": 2.0,
    }
    values = [prove.measured(p, raw).value for p in proof.promises]
    assert values == [3.0, 1.5, 7.0, 50.0, 9.0, 2.0]


def test_a_proof_leaves_its_figures_with_date_and_commands(tmp_path: Path):
    simple = Proof(
        name="doctor",
        commands=(("solve", "--help"), ("router", "--print-config", "--room", "lab")),
        promises=(Promise(name="delay", unit="s", take=lambda f: f["scouting"]["delay"], at_most=0.0),),
    )
    (figure,) = prove.prove(simple, tmp_path, Path("nowhere"))
    written = json.loads((tmp_path / "doctor.json").read_text())
    assert figure.kept is True
    assert written["commands"] == ["brachium solve --help", "brachium router --print-config --room lab"]
    assert written["date"].endswith("+00:00")
    assert written["figures"] == [{"name": "delay", "value": 0, "unit": "s", "at_most": 0.0, "kept": True}]


def test_a_command_that_fails_is_said(tmp_path: Path):
    broken = Proof(name="x", commands=(("solve", "nothing.mcap"),), promises=(promise(1.0),))
    with pytest.raises(prove.Failed, match=r"nothing\.mcap"):
        prove.prove(broken, tmp_path, Path("nowhere"))
    assert list(tmp_path.iterdir()) == []


def test_a_command_that_hangs_is_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(prove, "LONGEST_S", 0.01)
    slow = Proof(name="x", commands=(("router", "--help"),), promises=(promise(1.0),))
    with pytest.raises(prove.Failed, match="not done in"):
        prove.prove(slow, tmp_path, Path("nowhere"))
