"""The service's part of calibrations: found in a thread, kept, remembered, answered."""

import time
from types import SimpleNamespace

import numpy as np
import pytest

from brachium_fusion import calibration_desk
from brachium_fusion.calibration_desk import CalibrationDesk
from brachium_fusion.kept import Kept
from brachium_fusion.pipeline import Pipeline
from brachium_fusion.pose import Alignment
from brachium_fusion.settings import Change, Settings
from brachium_wire.codec import decode
from brachium_wire.messages import Answer, Calibration, Info

SEGMENTS = ("upper_arm_r", "forearm_r")
NOW = 1_700_000_000_000_000_000


def pipeline_with(nodes: dict[str, str], origin="worn") -> Pipeline:
    pipeline = Pipeline(Settings(auto_pose=False))
    for segment, node in nodes.items():
        info = Info(node=node, rate_hz=50.0, origin=origin, host="gw")
        pipeline.subject("p01").inform(segment, info)
    return pipeline


NODES = {segment: f"esp-{segment}" for segment in SEGMENTS}


def aligned() -> Alignment:
    turned = np.array([0.8, 0.6, 0.0, 0.0])
    return Alignment(
        forward="mounting",
        heading={"upper_arm_r": 0.0, "forearm_r": 0.3},
        mounting=dict.fromkeys(SEGMENTS, turned),
        scores={"sway_deg_forearm_r": 0.5},
    )


def done(state="done", **more) -> Calibration:
    mounting = dict.fromkeys(SEGMENTS, (0.8, 0.6, 0.0, 0.0))
    return Calibration(time_ns=NOW, state=state, mounting=mounting, **more)


def kept_after_calibration(folder, origin="worn") -> Kept:
    """Return the folder after a calibration of worn sensors came to its end."""
    pipeline, kept = pipeline_with(NODES, origin), Kept(folder)
    pipeline.subject("p01").calibrating.alignment = aligned()
    CalibrationDesk(pipeline, "gym", kept).finished("p01", done())
    return kept


def test_the_same_sensors_are_known_again_by_a_fusion_that_starts_again(tmp_path) -> None:
    kept = kept_after_calibration(tmp_path)
    pipeline = pipeline_with(NODES)
    desk = CalibrationDesk(pipeline, "gym", kept)
    [(subject, data)] = desk.changes()
    assert subject == "p01"
    pipeline.apply("p01", Change(0, "align", data))
    calibrating = pipeline.subject("p01").calibrating
    calibrating.change(NOW, "align", data)
    assert calibrating.alignment is not None
    assert calibrating.alignment.mounting["forearm_r"] == pytest.approx([0.8, 0.6, 0.0, 0.0])
    assert calibrating.alignment.assumed == {"forearm_r"}  # its own heading is another one since
    assert desk.changes() == []


@pytest.mark.parametrize(
    ("nodes", "origin"),
    [
        (NODES | {"forearm_r": "esp-other"}, "worn"),
        ({"forearm_r": NODES["forearm_r"]}, "worn"),
        (NODES, "emulated"),
        (NODES, "playback"),
    ],
)
def test_other_sensors_are_not_taken_for_them(tmp_path, nodes, origin) -> None:
    kept = kept_after_calibration(tmp_path)
    desk = CalibrationDesk(pipeline_with(nodes, origin), "gym", kept)
    assert desk.changes() == []
    assert CalibrationDesk(pipeline_with(NODES), "another-room", kept).changes() == []


@pytest.mark.parametrize("origin", ["emulated", "playback"])
def test_what_nobody_wears_is_not_kept(tmp_path, origin) -> None:
    kept_after_calibration(tmp_path, origin)
    assert list(tmp_path.iterdir()) == []


def request(result) -> SimpleNamespace:
    def fit():
        if isinstance(result, Exception):
            raise result
        return result

    return SimpleNamespace(fit=fit, from_ns=5)


def found_by(desk: CalibrationDesk, pipeline: Pipeline, waiting) -> list:
    pipeline.subject("p01").calibrating.fits = [waiting]
    deadline = time.monotonic() + 10.0
    while not (found := desk.changes()):
        assert time.monotonic() < deadline
        time.sleep(0.001)
    return found


def test_an_alignment_is_worked_out_beside_the_service(caplog) -> None:
    pipeline = pipeline_with(NODES)
    desk = CalibrationDesk(pipeline, "gym", None)
    assert found_by(desk, pipeline, request({"a": 1})) == [("p01", {"a": 1})]
    [(_, data)] = found_by(desk, pipeline, request(RuntimeError("no")))
    assert data["from_ns"] == 5
    assert "could not be worked out" in data["alignment"]["refused"]["alignment"]
    assert "could not be worked out" in caplog.text


def test_whoever_asked_is_answered_once(monkeypatch) -> None:
    answers: list[Answer] = []

    def reply(payload: bytes) -> None:
        answers.append(decode(payload, Answer))

    desk = CalibrationDesk(pipeline_with(NODES), "gym", None)
    desk.wait("p01", {"seconds": 3.0, "motions": ["free"]}, reply)
    desk.finished("p01", done("refused", reason="you moved", refused={"elbow": "too little"}))
    desk.finished("p01", done())
    assert [(a.ok, a.reason, a.data["refused"]) for a in answers] == [
        (False, "you moved", {"elbow": "too little"})
    ]
    desk.wait("p01", {"seconds": 3.0}, reply)
    desk.give_up()
    assert len(answers) == 1
    later = time.monotonic() + 3600.0
    monkeypatch.setattr(calibration_desk.time, "monotonic", lambda: later)
    desk.give_up()
    assert "no samples arrive" in answers[-1].reason
    desk.wait("p01", {"seconds": 3.0}, reply)
    desk.close()
    assert answers[-1].reason == "fusion is stopping"
    assert len(answers) == 3
