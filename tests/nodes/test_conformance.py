"""The suite that judges nodes is judged: a right node keeps every rule, one wrong thing breaks one rule."""

import os
import signal
import subprocess
import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from brachium_nodes.conformance.rules import NEEDS, RULES, Verdict
from brachium_nodes.conformance.suite import judge
from brachium_nodes.conformance.trial import QUICK, VARIABLES, Patience, Trial
from brachium_nodes.firmware_build import Build

SMALL_NODE = Path(__file__).with_name("small_node.py")
FIRMWARE_NODE = Path(__file__).with_name("firmware_node.py")
BREAKS = {
    **{rule: rule for rule in RULES},
    "mixed": "frames",  # two writers at once
}
"""What is wrong with a node, and the one rule that must fail."""

SEEKING = ("proof", "pong")
"""Those that find their gateway by themselves."""

pytestmark = pytest.mark.network


SMALL = Patience(listen_s=8.0, outage_s=6.0, start_s=60.0, return_s=20.0, silence_s=20.0, bye_s=10.0)
"""For the small node, which thirty others hold up: it goes after 6 s of silence, and pauses 3.6 s at most."""


def tried(wrong: str, unused_port: Callable[[], int]) -> list[Verdict]:
    words = (sys.executable, str(SMALL_NODE), "{host}", "{port}", "{id}", "{token}", wrong)
    seek_port = unused_port() if wrong in SEEKING else None
    words += () if seek_port is None else (str(seek_port),)
    return judge(Trial(command=words, node="n1", token="secret of n1", patience=SMALL), seek_port)


REAL = Patience(start_s=60.0, listen_s=4.0, outage_s=3.0)
FIRMWARE, EMULATED = "the firmware", "the emulated node"


def firmware_tried(build: Build, folder: Path) -> list[Verdict]:
    words = (sys.executable, str(FIRMWARE_NODE), str(folder / "flash"), str(build.firmware), str(build.board))
    command = (*words, "{port}", "{id}", "{token}")
    log = folder / "firmware.txt"
    return judge(Trial(command=command, node="n1", token="secret", patience=REAL, log=log))


def emulated_tried(endpoint: str, folder: Path) -> list[Verdict]:
    (folder / "token").write_text("secret", encoding="utf-8")
    gateway = ("--gateway", "ws://{host}:{port}/node", "--token-file", str(folder / "token"))
    command = (sys.executable, "-m", "brachium", "emulate", *gateway, "--endpoint", endpoint)
    words = (*command, "--segments", "forearm_r")
    log, node = folder / "emulated.txt", "emu-p01-forearm_r"
    return judge(Trial(command=words, node=node, token="secret", patience=REAL, log=log))


@pytest.fixture(scope="module")
def verdicts(
    firmware: Build, endpoint: str, tmp_path_factory: pytest.TempPathFactory, unused_port: Callable[[], int]
) -> dict[str, list[Verdict]]:
    """Every wrong node, and the right ones, all at the same time: they mostly wait."""
    folder = tmp_path_factory.mktemp("nodes")
    with pytest.MonkeyPatch.context() as patch, ThreadPoolExecutor(len(BREAKS) + 3) as pool:
        patch.setenv("PYTHONPATH", os.pathsep.join(filter(None, sys.path)))  # commands find what we found
        real = {
            FIRMWARE: pool.submit(firmware_tried, firmware, folder),
            EMULATED: pool.submit(emulated_tried, endpoint, folder),
        }
        small = {wrong: pool.submit(tried, wrong, unused_port) for wrong in ("", *BREAKS)}
        return {name: trial.result() for name, trial in (real | small).items()}


def test_a_right_node_keeps_every_rule(verdicts) -> None:
    assert [v.rule for v in verdicts[""]] == list(RULES)
    assert [v for v in verdicts[""] if v.outcome == "failed"] == []
    assert [v.rule for v in verdicts[""] if v.outcome == "not claimed"] == ["proof"]


@pytest.mark.parametrize("wrong", BREAKS)
def test_a_wrong_node_breaks_the_one_rule(verdicts, wrong: str) -> None:
    broken = [v for v in verdicts[wrong] if v.outcome == "failed"]
    assert [v.rule for v in broken] == [BREAKS[wrong]], broken
    assert broken[0].says.startswith("expected: ")
    assert "; came: " in broken[0].says


def test_a_node_that_finds_its_gateway_is_told_apart(verdicts) -> None:
    found = {wrong: {v.rule: v.outcome for v in verdicts[wrong]}["proof"] for wrong in verdicts}
    assert found.pop("proof") == "failed"
    assert found.pop("pong") == "ok"
    assert set(found.values()) == {"not claimed"}


def test_what_cannot_be_told_is_no_failure() -> None:
    assert all(rule in RULES and set(dependent) <= set(RULES) for rule, dependent in NEEDS.items())
    assert all(rule not in dependent for rule, dependent in NEEDS.items())


def test_the_command_s_words_and_variables_say_where_the_gateway_is() -> None:
    trial = Trial(command=("a{host}", "{port}", "{id}/{token}", "{other}"), node="n", token="t", port=7)
    assert trial.words() == ["a127.0.0.1", "7", "n/t", "{other}"]
    assert set(VARIABLES) == {"host", "port", "id", "token"}


def test_a_command_that_is_none_is_said() -> None:
    with pytest.raises(ValueError, match="cannot be started"):
        judge(Trial(command=("no-such-node",), node="n", token="t", patience=QUICK))


def test_a_command_that_is_interrupted_as_it_starts_is_ended(monkeypatch: pytest.MonkeyPatch) -> None:
    begun: list[subprocess.Popen[bytes]] = []

    class Interrupted(subprocess.Popen):  # type: ignore[type-arg]
        def __init__(self, *words, **more) -> None:
            super().__init__(*words, **more)
            begun.append(self)
            signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr(subprocess, "Popen", Interrupted)
    words = (sys.executable, "-c", "import time; time.sleep(60)")
    try:
        with pytest.raises(KeyboardInterrupt):
            judge(Trial(command=words, node="n", token="t", patience=QUICK))
        assert begun[0].poll() is not None
    finally:
        begun[0].kill()


def test_nothing_is_kept_where_nobody_calls() -> None:
    words = (sys.executable, "-c", "raise SystemExit(3)")
    patience = Patience(start_s=3.0)
    verdicts = judge(Trial(command=words, node="n", token="t", patience=patience))
    assert [v.rule for v in verdicts] == list(RULES)
    assert [v.rule for v in verdicts if v.outcome == "failed"] == ["request"]
    assert "nobody called in 3 s; the command ended with 3" in verdicts[0].says
    assert {v.outcome for v in verdicts[1:]} == {"not claimed"}


def kept_whole(verdicts: list[Verdict], not_claimed: set[str]) -> None:
    assert [v for v in verdicts if v.outcome == "failed"] == []
    assert {v.rule for v in verdicts if v.outcome == "not claimed"} == not_claimed


def test_the_firmware_of_the_wearables_keeps_every_rule(verdicts) -> None:
    kept_whole(verdicts[FIRMWARE], {"proof"})


def test_the_emulated_node_keeps_every_rule_that_it_claims(verdicts) -> None:
    # It is no wearable: a token that is refused is told to whoever started it, and it keeps no samples.
    kept_whole(verdicts[EMULATED], {"proof", "back-off", "late"})
