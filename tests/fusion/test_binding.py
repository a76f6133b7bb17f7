"""What joints tell live: relative heading without magnetometer, shoulder, slipped straps; off for others."""

import msgpack
import numpy as np
import pytest

from brachium_body import rotation
from brachium_fusion.pipeline import Pipeline
from brachium_fusion.settings import Settings
from brachium_nodes.session import session_arrays
from brachium_nodes.wearer import WearerSettings
from brachium_wire.codec import decode
from brachium_wire.messages import Info, Snapshot

RATE, BATCH = 50.0, 5


def session_of(exercise: str, seconds: float, **more):
    worn = {"segments": ("upper_arm_r", "forearm_r")} | more
    return session_arrays(
        WearerSettings(exercise=exercise, level="ideal", seed=5, rate_hz=RATE, **worn), seconds
    )


class Live:
    """A pipeline that is fed a session; `drift` turns headings away as gyroscopes' biases do."""

    def __init__(self, made, session, *, magnetometer=True, drift=None, cut=None, **chosen):
        self.settings = Settings(**chosen)
        self.pipeline, self.skeletons, self.news = Pipeline(self.settings), [], []
        for segment, sensor in session.sensors.items():
            info = Info(
                node=segment,
                rate_hz=RATE,
                origin="emulated",
                host="gw",
                mounting=tuple(sensor.nominal_mounting.tolist()),
                magnetometer=magnetometer,
            )
            self.pipeline.subject("p").inform(segment, info)
        for first in range(0, len(session.time_s) - BATCH, BATCH):
            rows = slice(first, first + BATCH)
            for segment, sensor in session.sensors.items():
                mag = {"mag": sensor.mag[rows]} if magnetometer else {}
                up = sensor.acc[rows] / np.linalg.norm(sensor.acc[rows], axis=1, keepdims=True)
                gyr = sensor.gyr[rows] + (drift or {}).get(segment, 0.0) * up
                batch = made.samples(first, rate=RATE, gyr=gyr, acc=sensor.acc[rows], **mag)
                self.pipeline.samples("p", segment, batch)
            self.take()
            if first == cut:
                snapshot = decode(self.pipeline.snapshot("p"), Snapshot)
                self.pipeline = Pipeline(self.settings)
                self.pipeline.restore("p", snapshot)
        self.take()

    def take(self):
        self.skeletons += [solved.skeleton for solved in self.pipeline.skeletons()]
        self.news += [news for _, news in self.pipeline.calibrations]
        self.pipeline.calibrations.clear()

    def row(self, made, skeleton) -> int:
        return round((skeleton.time_ns - made.START) * 1e-9 * RATE)


def relative_error_deg(made, live, session, from_s: float) -> float:
    """Return the RMS error of the forearm seen from the upper arm."""
    errors = []
    truth = session.arms["right"].world_from_segment
    for skeleton in live.skeletons:
        row = live.row(made, skeleton)
        if row < from_s * RATE:
            continue
        found = [skeleton.segments[s].world_from_segment for s in ("upper_arm_r", "forearm_r")]
        there = rotation.multiply(rotation.inverse(truth["upper_arm_r"][row]), truth["forearm_r"][row])
        here = rotation.multiply(rotation.inverse(found[0]), found[1])
        errors.append(float(rotation.angle_between(there, here)))
    return float(np.degrees(np.sqrt(np.mean(np.square(errors)))))


@pytest.fixture(scope="module")
def drawing():
    return session_of("free", 40.0)


def test_the_joint_keeps_the_heading_between_two_sensors_that_drift(made, drawing) -> None:
    drift = {"upper_arm_r": 0.004, "forearm_r": -0.004}  # rad/s about the vertical: 9 deg in 20 s
    chosen = {"magnetometer": False, "shoulder": False}
    alone = Live(made, drawing, drift=drift, joints=False, **chosen)
    bound = Live(made, drawing, drift=drift, **chosen)
    still = Live(made, drawing, **chosen)
    errors = [relative_error_deg(made, live, drawing, 20.0) for live in (alone, bound, still)]
    assert errors[0] > 9.0
    assert errors[1] < 5.0
    assert errors[1] < errors[2] + 1.0  # what is left comes from the mounting, which a pose alone gives
    told = {name: np.degrees(sd) for name, sd in bound.skeletons[-1].angle_sd.items()}
    assert told.keys() == {
        "shoulder_flexion",
        "shoulder_abduction",
        "shoulder_rotation",
        "elbow_flexion",
        "forearm_pronation",
    }
    assert 1.0 < told["elbow_flexion"] == told["forearm_pronation"] < 6.0
    assert 2.0 < told["shoulder_flexion"] < 4.0  # after a pose, and drifting since
    assert alone.skeletons[-1].angle_sd.keys() == set(list(told)[:3])  # nobody estimates the elbow's


def test_other_filters_stay_as_they_were_published(made, drawing) -> None:
    plain = Live(made, drawing, filter="vqf")
    without = Live(made, drawing, filter="vqf", joints=False, shoulder=False)
    assert plain.skeletons == without.skeletons
    assert all(s.shoulder_shift is None for s in plain.skeletons)


@pytest.mark.parametrize("exercise", ["shrugging", "reaching"])
def test_a_shoulder_is_followed_with_its_uncertainty(made, exercise) -> None:
    session = session_of(exercise, 24.0)
    live = Live(made, session)
    truth = session.arms["right"].shoulder_shift
    late = [s for s in live.skeletons if live.row(made, s) > 6.0 * RATE]
    known = [s for s in late if s.shoulder_shift is not None]
    assert len(known) > 0.9 * len(late) > 700
    error = np.array([np.array(s.shoulder_shift) - truth[live.row(made, s)] for s in known])
    sd = np.array([s.shoulder_shift_sd for s in known])
    assert np.sqrt(np.mean(np.sum(error**2, axis=1))) < 0.012
    assert (sd > 0.0).all()
    assert np.mean(np.abs(error) < 3.0 * sd) > 0.95
    places = np.array([s.positions["shoulder"] for s in known])
    moved = np.array([s.shoulder_shift for s in known])
    assert places - moved == pytest.approx(np.tile(places[0] - moved[0], (len(known), 1)))


def test_a_snapshot_in_the_midst_of_a_shrug_changes_nothing(made) -> None:
    session = session_of("shrugging", 12.0)
    whole, again = Live(made, session), Live(made, session, cut=400)
    assert again.skeletons == whole.skeletons
    assert any(s.shoulder_shift is not None for s in again.skeletons[420:])


def test_where_nothing_is_to_be_estimated_nothing_is(made) -> None:
    session = session_of("shrugging", 8.0)
    live = Live(made, session, shoulder=False)
    state = msgpack.unpackb(decode(live.pipeline.snapshot("p"), Snapshot).state)["subject"]["binding"]
    assert state["arms"]["right"]["joints"] == {}
    assert state["rests"] == {}


def test_a_slipped_strap_is_told_and_its_segment_is_disturbed_from_then_on(made) -> None:
    settings = WearerSettings(
        exercise="shrugging",
        level="patient",
        seed=6,
        rate_hz=RATE,
        segments=("upper_arm_r", "forearm_r", "hand_r"),
    )
    session = session_arrays(settings, 90.0)
    assert session.slip is not None
    segment, at_s = session.slip
    live = Live(made, session)
    told = [news for news in live.news if any("has turned by about" in w for w in news.warnings)]
    assert told
    found_ns = told[0].time_ns
    assert found_ns > made.START + at_s * 1e9
    place = segment.removesuffix("_r").replace("_", " ")
    assert place in told[0].warnings[-1]
    after = {s.segments[segment].quality for s in live.skeletons if s.time_ns > found_ns}
    assert after == {"disturbed"}
