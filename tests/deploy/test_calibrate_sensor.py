"""`brachium calibrate --sensor`: over a whole network, what it shows, what it refuses to begin."""

import json
import re
import threading
from collections.abc import Iterator
from dataclasses import replace

import pytest

from brachium import bench_sensors, calibrate_sensor, sensor_picture, sensor_trials
from brachium.__main__ import main
from brachium.sensor_trials import as_in_the_paper, guided, residuals
from brachium_fusion.sensor_guide import SensorGuide
from brachium_fusion.service import FuseSettings
from brachium_fusion.service import run as fuse
from brachium_fusion.settings import Settings
from brachium_nodes import emulate_bench
from brachium_nodes.emulate import EmulateSettings
from brachium_nodes.wearer import WearerSettings
from brachium_wire import keys
from brachium_wire.bus import Bus
from brachium_wire.messages import SensorCalibration
from brachium_wire.samples import Samples
from brachium_wire.sensor_records import SensorProgress

ROOM = "sensors"
WITHIN_S = 60.0
SEGMENT = "forearm_r"


@pytest.fixture(scope="module")
def network(endpoint: str) -> Iterator[str]:
    """Run fusion, and hands that follow it eight times as fast as people do."""
    stop = threading.Event()
    wearer = WearerSettings(level="typical", segments=(SEGMENT,), rate_hz=50.0, batch=10, seed=2)
    hands = EmulateSettings(endpoint=endpoint, room=ROOM, direct=True, speed=8.0, wearer=wearer)
    calm = FuseSettings(endpoint=endpoint, room=ROOM, pipeline=Settings(auto_pose=False))
    running = [
        threading.Thread(target=fuse, args=(calm, stop)),
        threading.Thread(target=emulate_bench.run, args=(hands, "", stop)),
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


def words(endpoint: str, *more: str) -> list[str]:
    return ["calibrate", "--endpoint", endpoint, "--room", ROOM, *more]


@pytest.mark.network
def test_through_gateway_router_and_fusion_to_a_node_that_brings_it_when_switched_on_again() -> None:
    figures = bench_sensors.over_a_network(["rest"])
    assert (figures.kept, figures.kept_after_restart, figures.brought_again) == ("node", "node", True)
    assert figures.left.gyro_bias_dps < 0.02
    assert residuals(bench_sensors.SEED, SensorCalibration()).gyro_bias_dps > 1.0


@pytest.fixture
def impatient(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nobody will say that he keeps it: do not wait for that."""
    monkeypatch.setattr(calibrate_sensor, "KEPT_WITHIN_S", 0.2)


@pytest.mark.network
@pytest.mark.usefixtures("impatient")
def test_all_steps_are_led_over_a_network(network: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(words(network, "--sensor", SEGMENT)) == 0
    said = capsys.readouterr().out
    # On the bus is how far it is, not how it came there: a busy machine may tell of several looks at once.
    steps = re.findall(r"^(rest|faces|turn): ", said, re.MULTILINE)
    assert steps
    assert steps == sorted(steps, key=["rest", "faces", "turn"].index)
    assert f"{SEGMENT} (emu-p01-forearm_r):\n" in said
    assert "gyro bias, deg/s: " in said
    assert "no gateway has taken it yet" in said  # these hands' node has none


def test_all_steps_are_led_in_plain_lines(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    screen = calibrate_sensor._Screen(quiet=False)

    class Shown(SensorGuide):
        def take(self, samples: Samples) -> bool:
            new = super().take(samples)
            if new:
                screen.show(self.progress())
            return new

    monkeypatch.setattr(sensor_trials, "SensorGuide", Shown)
    assert guided(2).progress().state == "done"
    said = capsys.readouterr().out
    assert (
        said.index("rest: put the sensor") < said.index("faces: lay it on") < said.index("turn: pick it up")
    )
    assert "still to point upwards: -x, +y, -y, +z, -z" in said
    covered = [int(share) for share in re.findall(r"\(([0-9]+) % of all directions\)", said)]
    assert covered == sorted(covered)
    assert covered[-1] >= 70


@pytest.mark.network
@pytest.mark.usefixtures("impatient")
def test_one_step_alone_in_json(network: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(words(network, "--sensor", SEGMENT, "--steps", "rest", "--json")) == 0
    figures = json.loads(capsys.readouterr().out)
    assert figures["ok"] is True
    assert figures["node"] == "emu-p01-forearm_r"
    assert set(figures["calibration"]) == {"gyro_bias"}
    assert figures["scores"]["rest_s"] == pytest.approx(5.0, abs=0.1)


@pytest.mark.network
def test_a_sensor_that_is_not_there_is_named(network: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(words(network, "--sensor", "hand_l")) == 1
    assert "no sensor on hand_l has been heard; there is forearm_r" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("more", "said"),
    [
        (("--sensor", "knee"), "--sensor takes one of"),
        (("--steps", "rest"), "--steps belongs to --sensor"),
        (("--sensor", SEGMENT, "--steps", "dance"), "some of rest,faces,turn"),
        (("--sensor", SEGMENT, "--zero"), "no --zero"),
    ],
)
def test_what_cannot_be_asked_is_said_at_once(
    more: tuple[str, ...], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    try:
        code = main(words("tcp/127.0.0.1:1", *more))
    except SystemExit as end:
        code = int(str(end.code))
    assert code == 2
    assert said in capsys.readouterr().err


def progress(**more: object) -> SensorProgress:
    steps = ["rest", "faces", "turn"]
    return SensorProgress(**{"segment": SEGMENT, "node": "n1", "state": "running", "steps": steps} | more)


def test_the_picture_ticks_faces_and_fills_the_sphere() -> None:
    faces = sensor_picture.picture(progress(step="faces", faces=["+x", "-z"], still=True, left_s=0.8))
    assert faces[0] == "forearm_r: step 2 of 3, faces"
    assert faces[2] == "  [x] +x   [ ] -x   [ ] +y   [ ] -y   [ ] +z   [x] -z"
    assert faces[3] == "  lies still, 0.8 s more"
    cells = "#" * 8 + "." * 40
    turn = sensor_picture.picture(progress(step="turn", cells=cells, coverage=8 / 48, left_s=3.0))
    assert turn[2] == "  [###.................]  17 % of all directions, 3 s more"
    assert turn[3] == "  +z  # # # # # # # #"
    assert turn[8] == "  -z  . . . . . . . ."
    rest = progress(step="rest", attempt=2, refused={"rest": "it was moved"}, reason="leave it")
    assert sensor_picture.picture(rest)[:3] == [
        "forearm_r: step 1 of 3, rest, attempt 2",
        "refused: it was moved",
        "leave it",
    ]
    assert sensor_picture.line(rest) == "rest, attempt 2: leave it"


def test_why_a_step_was_refused_is_said_once_and_then_what_to_do(capsys: pytest.CaptureFixture[str]) -> None:
    screen = calibrate_sensor._Screen(quiet=False)
    refused = {"refused": {"turn": "it was too slow"}, "attempt": 2}
    screen.show(progress(step="turn", reason="turn it about"))
    for share in (0.0, 0.2, 0.5):
        screen.show(progress(step="turn", reason="turn it about, faster", coverage=share, **refused))
    screen.show(progress(step="turn", reason="turn it", refused={"turn": "it was too slow"}, attempt=3))
    assert capsys.readouterr().out.splitlines() == [
        "turn: turn it about (0 % of all directions)",
        "turn refused: it was too slow",
        "turn, attempt 2: turn it about, faster (0 % of all directions)",
        "turn, attempt 2: turn it about, faster (20 % of all directions)",
        "turn, attempt 2: turn it about, faster (50 % of all directions)",
        "turn refused: it was too slow",
        "turn, attempt 3: turn it (0 % of all directions)",
    ]


def test_the_papers_way_leaves_soft_iron() -> None:
    paper = residuals(1, as_in_the_paper(1))
    assert paper.gyro_bias_dps < 0.02
    assert 0.5 < paper.mag_direction_deg < 10.0


def test_a_bad_handling_taken_for_good_is_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    network = bench_sensors.NetworkFigures(
        steps=["rest"], seconds=1.0, kept="node", kept_after_restart="node", brought_again=True,
        left=residuals(1, SensorCalibration()),
    )  # fmt: skip
    monkeypatch.setattr(bench_sensors, "over_a_network", lambda steps: replace(network, steps=steps or []))
    monkeypatch.setattr(bench_sensors, "MISTAKES", ("", "restless"))
    monkeypatch.setattr(bench_sensors, "guided", lambda seed, _mistake="": guided(seed))
    figures = bench_sensors.measure(1)
    assert figures.worst["guided"].mag_direction_deg < 0.5 < figures.worst["paper"].mag_direction_deg
    assert (figures.refused, figures.not_refused) == ({"restless": {}}, 1)
