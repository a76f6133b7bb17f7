"""`brachium calibrate` against fusion on a router: what it says, how it ends, what is kept."""

import json
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest

from brachium.__main__ import main
from brachium_fusion.service import FuseSettings
from brachium_fusion.service import run as fuse
from brachium_fusion.settings import Settings
from brachium_nodes.emulate import EmulateSettings
from brachium_nodes.emulate import run as emulate
from brachium_nodes.wearer import WearerSettings
from brachium_wire import keys
from brachium_wire.bus import Bus

pytestmark = pytest.mark.network

ROOM = "guided"
WITHIN_S = 60.0


@pytest.fixture
def network(endpoint: str, tmp_path: Path) -> Iterator[str]:
    """Run fusion, and an emulated wearer who stands still for as long as it takes."""
    stop = threading.Event()
    settings = FuseSettings(
        endpoint=endpoint, room=ROOM, pipeline=Settings(auto_pose=False), keep=tmp_path / "kept"
    )
    still = WearerSettings(stand_s=10.0 * WITHIN_S)
    wearer = EmulateSettings(endpoint=endpoint, room=ROOM, subject="p01", direct=True, wearer=still)
    running = [
        threading.Thread(target=fuse, args=(settings, stop)),
        threading.Thread(target=emulate, args=(wearer, stop)),
    ]
    with Bus.open(endpoint) as bus:
        heard = bus.subscribe(keys.subjects(ROOM, "skeleton/*"))
        for thread in running:
            thread.start()
        assert heard.wait(WITHIN_S)
    yield endpoint
    stop.set()
    for thread in running:
        thread.join(WITHIN_S)


def test_a_pose_is_asked_for_in_words_and_its_scores_are_told(
    network: str, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    words = ["calibrate", "--endpoint", network, "--room", ROOM, "--routine", "pose", "--seconds", "1"]
    assert main(words) == 0
    said = capsys.readouterr().out
    assert "0 %  stand or sit still" in said
    assert "calibrated; forward: " in said
    assert not (tmp_path / "kept").exists()  # nobody wears these sensors


def test_a_refusal_is_one_line_and_an_exit_code(network: str, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["calibrate", "--endpoint", network, "--room", ROOM, "--subject", "nobody", "--json"]
    assert main(words) == 1
    said = capsys.readouterr()
    assert json.loads(said.out)["ok"] is False
    assert "no sensor of subject 'nobody'" in said.err


def test_without_fusion_it_says_so(endpoint: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["calibrate", "--endpoint", endpoint, "--room", "empty"]) == 1
    assert "fusion does not answer" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--angle", "elbow_flexion=35"], "belongs to --pose given"),
        (["--pose", "given", "--angle", "elbow"], "write NAME=DEG"),
        (["--pose", "given", "--angle", "elbow=35"], "--angle elbow: no angle that can be stated"),
        (["--pose", "given", "--angle", "elbow_flexion=350"], "expected degrees, -15 to 160"),
        (["--pose", "given"], "--pose given needs the angles that are held"),
        (["--zero", "--pose", "table"], "--zero takes no --pose"),
        (["--seconds", "0"], "from 1 to 30"),
        (["--routine", "dance"], "invalid choice"),
    ],
)
def test_bad_input_is_usage(words: list[str], said: str, capsys: pytest.CaptureFixture[str]) -> None:
    try:
        code = main(["calibrate", *words])
    except SystemExit as ended:
        code = ended.code
    assert code == 2
    assert said in capsys.readouterr().err
