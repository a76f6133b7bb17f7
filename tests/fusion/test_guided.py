"""Calibration by pose and movement, as an emulated wearer is led through it; zero; what is kept."""

import msgpack
import numpy as np
import pytest

from brachium_body import rotation
from brachium_fusion.calibration_wish import checked_wish, checked_zero
from brachium_fusion.guided import WORDS
from brachium_fusion.kept import Kept, same_sensors
from brachium_fusion.pipeline import Pipeline
from brachium_fusion.settings import Change, Settings
from brachium_nodes.session import session_arrays
from brachium_nodes.wearer import WearerSettings
from brachium_wire.codec import decode
from brachium_wire.messages import Info, Snapshot

RATE, BATCH = 50.0, 5


@pytest.fixture(scope="module")
def session():
    settings = WearerSettings(
        routine="calibration",
        exercise="reaching",
        level="ideal",
        seed=4,
        rate_hz=RATE,
        segments=("upper_arm_r", "forearm_r"),
        carrying_deg=8.0,
    )
    return session_arrays(settings, 52.0)


def infos(session, *, magnetometer: bool, origin="worn"):
    return {
        segment: Info(
            node=f"n-{segment}",
            rate_hz=RATE,
            origin=origin,
            host="gw",
            mounting=tuple(sensor.nominal_mounting.tolist()),
            magnetometer=magnetometer,
        )
        for segment, sensor in session.sensors.items()
    }


def batches(made, session, *, magnetometer: bool, seconds: float):
    for first in range(0, min(len(session.time_s) - BATCH, round(seconds * RATE)), BATCH):
        rows = slice(first, first + BATCH)
        for segment, sensor in session.sensors.items():
            mag = {"mag": sensor.mag[rows]} if magnetometer else {}
            yield segment, made.samples(first, rate=RATE, gyr=sensor.gyr[rows], acc=sensor.acc[rows], **mag)


class Led:
    """A pipeline that is fed, with alignments found at once and snapshots taken where wanted."""

    def __init__(self, made, session, wish, *, magnetometer=False, restarts_at=(), seconds=99.0):
        self.news, self.skeletons, self.changes = [], [], []
        self.pipeline = Pipeline(Settings(auto_pose=False))
        for segment, info in infos(session, magnetometer=magnetometer).items():
            self.pipeline.subject("p01").inform(segment, info)
        self.pipeline.apply("p01", Change(made.START, "calibrate", checked_wish(wish)))
        for count, (segment, samples) in enumerate(
            batches(made, session, magnetometer=magnetometer, seconds=seconds)
        ):
            self.pipeline.samples("p01", segment, samples)
            self.collect()
            if count in restarts_at:
                snapshot = decode(self.pipeline.snapshot("p01"), Snapshot)
                self.pipeline = Pipeline(Settings(auto_pose=False))
                self.pipeline.restore("p01", snapshot)

    def collect(self):
        self.skeletons += [solved.skeleton for solved in self.pipeline.skeletons()]
        self.news += [news for _, news in self.pipeline.calibrations]
        self.pipeline.calibrations.clear()
        for subject, request in self.pipeline.fits():
            data = msgpack.unpackb(msgpack.packb(request.fit()))  # as an event carries it
            change = Change(self.pipeline.subject(subject).next_tick_ns(), "align", data)
            self.changes.append(change)
            self.pipeline.apply(subject, change)


@pytest.fixture(scope="module")
def led(made, session):
    return Led(made, session, {"routine": "guided"})


def test_each_step_is_told_in_words_and_progress_only_grows(led) -> None:
    running = [news for news in led.news if news.state == "running"]
    steps = list(dict.fromkeys(news.motion for news in running))
    assert led.news[0].state == "waiting"
    assert led.news[0].reason == WORDS["n-pose"]
    assert steps == ["elbow-flexion", "pronation", "free", ""]
    assert all(news.reason == WORDS[news.motion] for news in running if news.motion)
    progress = [news.progress for news in running]
    assert progress == sorted(progress)
    assert led.news[-1].state == "done"
    assert led.news[-1].scores
    kinds = [span[0] for span in led.changes[0].data["spans"]]
    assert kinds == ["n-pose", "elbow-flexion", "pronation", "free"]


def test_it_finds_axes_and_heading_without_a_magnetometer(led, session) -> None:
    alignment = led.pipeline.subject("p01").calibrating.alignment
    joint = alignment.joints["elbow_r"]
    assert np.degrees(joint.carrying_rad) == pytest.approx(np.degrees(session.carrying), abs=1.5)
    for segment, sensor in session.sensors.items():
        off = rotation.angle_between(alignment.mounting[segment], sensor.segment_from_sensor[100])
        assert np.degrees(off) < 3.0
    after = [s for s in led.skeletons if s.time_ns > led.news[-1].time_ns + 2_000_000_000]
    truth = session.arms["right"].angles["elbow_flexion"]
    row = [round((s.time_ns - led.skeletons[0].time_ns) * 1e-9 * RATE) for s in after]
    first = round((led.skeletons[0].time_ns - 1_700_000_000_000_000_000) * 1e-9 * RATE)
    error = [s.angles["elbow_flexion"] - truth[first + i] for s, i in zip(after, row, strict=True)]
    assert len(after) > 100
    assert np.degrees(np.sqrt(np.mean(np.square(error)))) < 1.5


def test_a_snapshot_in_the_midst_of_it_changes_nothing(made, session, led) -> None:
    again = Led(made, session, {"routine": "guided"}, restarts_at=(90, 700, 800))
    assert [n for n in again.news if n.state == "done"] == [n for n in led.news if n.state == "done"]
    assert again.skeletons == led.skeletons


def test_whoever_does_not_move_is_refused_with_what_was_waited_for(made, session) -> None:
    pipeline = Pipeline(Settings(auto_pose=False))
    for segment, info in infos(session, magnetometer=False).items():
        pipeline.subject("p01").inform(segment, info)
    pipeline.apply("p01", Change(made.START, "calibrate", checked_wish({"routine": "guided"})))
    up = np.tile([0.0, 9.81, 0.0], (BATCH, 1))
    for first in range(0, 2000, BATCH):
        for segment in session.sensors:
            samples = made.samples(first, rate=RATE, gyr=np.zeros((BATCH, 3)), acc=up)
            pipeline.samples("p01", segment, samples)
    news = [told for _, told in pipeline.calibrations]
    assert news[-1].state == "refused"
    assert WORDS["elbow-flexion"] in news[-1].reason


def test_what_is_found_for_an_older_question_is_left_aside(made, led) -> None:
    pipeline = led.pipeline
    known = pipeline.subject("p01").calibrating.alignment
    stale = led.changes[0].data | {"from_ns": 17}
    pipeline.subject("p01").calibrating.change(made.START, "align", stale)
    assert pipeline.subject("p01").calibrating.alignment is known


@pytest.mark.parametrize("magnetometer", [False, True])
def test_headings_are_set_anew_by_arms_that_hang(made, session, magnetometer) -> None:
    led = Led(made, session, {}, magnetometer=magnetometer, seconds=5.0)
    calibrating = led.pipeline.subject("p01").calibrating
    before = calibrating.alignment
    turned = {s: rotation.multiply(rotation.about(2, 0.5), q) for s, q in standing(before).items()}
    calibrating.change(made.START, "zero", checked_zero({}))
    held = type("Held", (), {"world_from_sensor": {s: q[None] for s, q in turned.items()}})
    calibrating._take_pose(held, led.pipeline.subject("p01").tracks, led.pipeline.subject("p01").session)
    after = calibrating.alignment
    for segment, q in turned.items():
        assert after.mounting[segment] == pytest.approx(before.mounting[segment])
        q = rotation.multiply(rotation.about(2, after.heading[segment]), q)
        segment_q = rotation.multiply(q, rotation.inverse(after.mounting[segment]))
        in_trunk = rotation.multiply(rotation.inverse(after.world_from_trunk), segment_q)
        assert np.degrees(rotation.angle_between(in_trunk, [0.5, 0.5, 0.5, 0.5])) < 3.0


def standing(alignment):
    """Return world_from_sensor of sensors that stand as in the n-pose, as the alignment has it."""
    neutral = rotation.multiply(alignment.world_from_trunk, [0.5, 0.5, 0.5, 0.5])
    return {
        s: rotation.multiply(
            rotation.about(2, -alignment.heading[s]), rotation.multiply(neutral, alignment.mounting[s])
        )
        for s in alignment.mounting
    }


def test_what_may_be_asked_is_said() -> None:
    with pytest.raises(ValueError, match="routine 'dance' is not known; it is pose, guided, free"):
        checked_wish({"routine": "dance"})
    with pytest.raises(ValueError, match="motions are some of"):
        checked_wish({"motions": ["hop"]})
    with pytest.raises(ValueError, match="does not know 'motion'"):
        checked_wish({"motion": "free"})
    with pytest.raises(ValueError, match="takes angles_deg: the angles that are held"):
        checked_wish({"pose": "given"})
    with pytest.raises(ValueError, match="takes angles_deg"):
        checked_wish({"pose": "table", "angles_deg": {"elbow_flexion": 80.0}})
    with pytest.raises(ValueError, match=r"angles_deg\.elbow_flexion = 350: no joint does that"):
        checked_wish({"pose": "given", "angles_deg": {"elbow_flexion": 350.0}})
    with pytest.raises(ValueError, match="zero takes seconds"):
        checked_zero({"pose": "n-pose"})
    assert checked_wish({"routine": "free"})["motions"] == ["free"]


def test_a_calibration_is_kept_for_the_same_sensors_of_a_person(tmp_path, led, session) -> None:
    alignment = led.pipeline.subject("p01").calibrating.alignment
    worn = infos(session, magnetometer=False)
    kept = Kept(tmp_path)
    assert kept.load("gym", "p01") is None
    kept.save("gym", "p01", worn, alignment.state(), 5)
    found = kept.load("gym", "p01")
    assert found is not None
    pipeline = Pipeline(Settings())
    for segment, info in worn.items():
        pipeline.subject("p01").inform(segment, info)
    pipeline.apply("p01", Change(0, "align", {"alignment": found["alignment"], "kept": True}))
    assert same_sensors(found["sensors"], worn)
    assert not same_sensors(found["sensors"], infos(session, magnetometer=False, origin="emulated"))
    assert not same_sensors(found["sensors"], {"upper_arm_r": worn["upper_arm_r"]})
    assert not same_sensors({}, worn)
    assert [path.name for path in tmp_path.rglob("*") if path.is_file()] == ["p01.json"]
    assert "n-upper_arm_r" in (tmp_path / "gym" / "p01.json").read_text()


@pytest.mark.parametrize("content", ["", "{}", '{"version": 9}', '{"version": 1, "sensors": 3}', "[1]"])
def test_a_kept_file_that_cannot_be_used_is_left_aside(tmp_path, caplog, content) -> None:
    (tmp_path / "gym").mkdir()
    (tmp_path / "gym" / "p01.json").write_text(content)
    assert Kept(tmp_path).load("gym", "p01") is None
    assert "left aside" in caplog.text


def test_an_alignment_that_is_none_is_refused_before_it_disturbs_anything() -> None:
    pipeline = Pipeline()
    for data in ({}, {"alignment": {}}, {"alignment": {"mounting": 3}}):
        with pytest.raises(ValueError, match="align: no alignment"):
            pipeline.apply("p01", Change(0, "align", data))
