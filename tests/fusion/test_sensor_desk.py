"""The service's part of sensor calibration: who asked is answered once, what is known is told whole."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from brachium_fusion import magnetometer_calibration as magnetometer
from brachium_fusion import sensor_desk
from brachium_fusion import sphere_coverage as sphere
from brachium_fusion.calibrated import recalibrated
from brachium_fusion.calibration_wish import checked_sensor_wish
from brachium_fusion.pipeline import Pipeline
from brachium_fusion.sensor_calibration import Refused
from brachium_fusion.sensor_desk import SensorDesk
from brachium_fusion.settings import Settings
from brachium_wire import keys
from brachium_wire.codec import decode, encode
from brachium_wire.messages import Answer, Calibration, Info, SensorCalibration
from brachium_wire.samples import write_samples

NOW = 1_700_000_000_000_000_000
RATE = 50.0


def info(**more: Any) -> Info:
    return Info(
        **{"node": "n1", "rate_hz": RATE, "origin": "worn", "host": "gw", "magnetometer": True} | more
    )


class Room:
    """A pipeline with one sensor, and a desk."""

    def __init__(self) -> None:
        self.pipeline = Pipeline(Settings(auto_pose=False))
        self.pipeline.subject("p01").inform("forearm_r", info())
        self.desk = SensorDesk(self.pipeline)
        self.answers: list[Answer] = []

    def ask(self, **arguments: Any) -> None:
        self.desk.begin("p01", arguments, lambda payload: self.answers.append(decode(payload, Answer)))

    def rest(self, seconds: float, segment: str = "forearm_r") -> None:
        random = np.random.default_rng(1)
        for first in range(0, round(seconds * RATE), 10):
            times = [NOW + round(1e9 * (first + k) / RATE) for k in range(10)]
            batch = write_samples(
                sequence=first, time_ns=times, device_us=[t // 1000 for t in times], received_ns=times[-1],
                uncertainty_ns=1000, acc=[[0.0, 0.0, 9.81]] * 10,
                gyr=0.1 + 1e-3 * random.normal(size=(10, 3)),
            )  # fmt: skip
            self.desk.see(keys.Key("lab", "p01", "imu", segment), encode(batch))

    def told(self, known: Calibration | None = None) -> Calibration:
        return self.desk.complete("p01", known)


def test_a_rest_is_answered_once_and_told_beside_what_was_known() -> None:
    room = Room()
    room.ask(sensor="forearm_r", steps=["rest"])
    assert room.desk.news == {"p01"}
    room.rest(3.0, "upper_arm_r")
    room.rest(3.0)
    running = room.told().sensor
    assert running is not None
    assert (running.state, running.step, running.still) == ("running", "rest", True)
    room.rest(7.0)
    (answer,) = room.answers
    assert answer.ok
    assert answer.data["node"] == "n1"
    assert answer.data["calibration"]["gyro_bias"] == pytest.approx([0.1] * 3, abs=1e-3)
    known = Calibration(
        time_ns=NOW, state="done", pose="n-pose", mounting={"forearm_r": (1.0, 0.0, 0.0, 0.0)}
    )
    whole = room.told(known)
    assert (whole.state, whole.pose, whole.mounting) == ("done", "n-pose", known.mounting)
    assert whole.sensor is not None
    assert whole.sensor.state == "done"
    assert whole.sensors["n1"].gyro_bias == pytest.approx((0.1,) * 3, abs=1e-3)
    assert room.told().state == "none"
    room.rest(7.0)
    room.desk.close()
    assert len(room.answers) == 1


def test_who_asks_again_ends_the_first_and_silence_ends_all(monkeypatch: pytest.MonkeyPatch) -> None:
    room = Room()
    room.ask(sensor="forearm_r")
    room.ask(sensor="forearm_r", steps=["rest"])
    assert [a.reason for a in room.answers] == ["another calibration of a sensor was asked for"]
    room.desk.give_up()
    assert len(room.answers) == 1
    later = sensor_desk.time.monotonic() + 60.0
    monkeypatch.setattr(sensor_desk.time, "monotonic", lambda: later)
    room.desk.give_up()
    assert "no samples arrive" in room.answers[1].reason
    told = room.told().sensor
    assert told is not None
    assert told.state == "refused"
    assert room.told().sensors == {}
    room.ask(sensor="forearm_r")
    room.desk.close()
    assert room.answers[2].reason == "fusion is stopping"


@pytest.mark.parametrize(
    ("arguments", "why"),
    [
        ({"sensor": "knee"}, "segment 'knee' is not known"),
        ({"sensor": "forearm_r", "steps": []}, "steps are some of rest, faces, turn"),
        ({"sensor": "forearm_r", "steps": "rest"}, "steps are some of"),
        ({"sensor": "forearm_r", "steps": ["dance"]}, "steps are some of"),
        ({"sensor": "forearm_r", "pose": "n-pose"}, "does not know 'pose'"),
    ],
)
def test_a_wish_that_cannot_be_is_refused_at_the_door(arguments: dict[str, Any], why: str) -> None:
    with pytest.raises(ValueError, match=why):
        checked_sensor_wish(arguments)
    room = Room()
    with pytest.raises(ValueError, match="no sensor on hand_r has been heard; there is forearm_r"):
        room.ask(sensor="hand_r")


def test_a_calibration_that_comes_back_is_applied_and_who_keeps_it_begins_nothing_anew() -> None:
    subject = Room().pipeline.subject("p01")
    before = subject.tracks["forearm_r"]
    found = SensorCalibration(gyro_bias=(0.1, 0.0, 0.0))
    subject.inform("forearm_r", info(calibration=found, kept="gateway"))
    track = subject.tracks["forearm_r"]
    assert track is not before
    assert track.info.calibration == found
    subject.inform("forearm_r", info(calibration=found, kept="node"))
    assert subject.tracks["forearm_r"] is track
    assert track.info.kept == "node"
    assert recalibrated(info(), info(calibration=found, kept="node"))
    assert not recalibrated(info(), info(calibration=found, node="n2"))


@given(st.integers(0, 1000))
def test_cells_are_of_equal_area_and_what_is_left_out_lacks(seed: int) -> None:
    random = np.random.default_rng(seed)
    directions = random.normal(size=(4800, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    assert sphere.cells_of(directions).all()
    counts = [np.count_nonzero(directions[:, 2] > 1.0 - 2.0 * k / sphere.BANDS) for k in (1, 2, 3)]
    assert np.diff(counts) == pytest.approx([800, 800], abs=150)
    axis, sign = int(random.integers(3)), float(random.choice([-1.0, 1.0]))
    half = directions[sign * directions[:, axis] < 0.2]
    cells = sphere.cells_of(half)
    assert sphere.lacking(cells) == ("+" if sign > 0.0 else "-") + "xyz"[axis]
    assert sphere.text_of(cells).count("#") == cells.sum()
    assert sphere.lacking(np.ones_like(cells)) == ""


def test_the_centre_is_found_and_held_where_nothing_tells() -> None:
    random = np.random.default_rng(3)
    directions = random.normal(size=(500, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    assert sphere.centre_of([30.0, -20.0, 5.0] + 46.0 * directions) == pytest.approx([30, -20, 5], abs=1.0)
    ring = np.column_stack([np.cos(np.arange(100)), np.sin(np.arange(100)), np.zeros(100)])
    assert sphere.centre_of([30.0, -20.0, 5.0] + 46.0 * ring)[2] == pytest.approx(5.0, abs=0.1)
    assert np.isfinite(sphere.centre_of(np.ones((5, 3)))).all()


def test_a_field_that_is_not_the_earths_is_refused() -> None:
    random = np.random.default_rng(3)
    directions = random.normal(size=(500, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    with pytest.raises(Refused, match="fit a field of 138 uT"):
        magnetometer.mag_ellipsoid(138.0 * directions)
    with pytest.raises(Refused, match="magnetometer's y stops at 300 uT"):
        magnetometer.mag_ellipsoid(np.clip(400.0 * directions, -1000.0, [1000.0, 300.0, 1000.0]))
