import threading

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from scipy.spatial.transform import Rotation

rr = pytest.importorskip("rerun", reason="needs the extra 'view'")

from brachium_viewer.drawings import Capsules, Degrees, Lane  # noqa: E402  after the check for the extra
from brachium_viewer.picture import Picture  # noqa: E402
from brachium_viewer.screen import Mailbox, Pen, Screen, capsules  # noqa: E402


def test_a_mailbox_that_nobody_empties_keeps_the_newest_of_each_path_and_counts_the_rest():
    mailbox = Mailbox()
    for n in range(1000):
        mailbox.put(float(n), {"a": Degrees(float(n)), "b": Lane("good")})
    mailbox.put(1000.0, {"c": Degrees(None)})
    assert mailbox.replaced == 2 * 999
    assert mailbox.take() == {
        "a": (999.0, Degrees(999.0)),
        "b": (999.0, Lane("good")),
        "c": (1000.0, Degrees(None)),
    }


def test_a_closed_mailbox_gives_what_is_left_and_then_nothing():
    mailbox = Mailbox()
    mailbox.put(1.0, {"a": Lane("good")})
    mailbox.close()
    assert mailbox.take() == {"a": (1.0, Lane("good"))}
    assert mailbox.take() is None


def test_take_waits_until_something_is_put():
    mailbox, got = Mailbox(), []
    thread = threading.Thread(target=lambda: got.append(mailbox.take()))
    thread.start()
    mailbox.put(2.0, {"a": Lane("held")})
    thread.join(15.0)
    assert got == [{"a": (2.0, Lane("held"))}]


@given(hnp.arrays(np.float64, (4, 3), elements=st.floats(-1.0, 1.0)))
def test_capsules_lie_along_their_ends(along):
    along[0] = (0.0, 0.0, -0.3)  # hanging straight down is the arm's neutral pose
    lengths = np.linalg.norm(along, axis=1)
    n = len(along)
    drawing = Capsules(np.zeros((n, 3)), along, np.full(n, 0.03), np.full((n, 4), 255, dtype=np.uint8))
    made = capsules(drawing)
    quaternions = np.array(made.quaternions.as_arrow_array().to_pylist())
    reached = Rotation.from_quat(quaternions).apply([0.0, 0.0, 1.0]) * lengths[:, None]
    assert reached == pytest.approx(along, abs=1e-5)  # Rerun keeps float32


def test_a_recording_of_the_view_holds_the_arm(arm_at, tmp_path):
    from rerun.chunk import RrdReader

    path = tmp_path / "view.rrd"
    recording = rr.RecordingStream("brachium-test", recording_id="one")
    recording.save(path)
    picture, pen = Picture(), Pen(recording)
    for n in range(30):
        now_s = n / 30.0
        quality = "good" if n < 20 else "held"
        skeleton = arm_at(now_s, quality=quality)
        if n == 25:  # the wrist is not known for a moment
            skeleton.angles.pop("wrist_flexion")
        seconds, drawings = picture.feed("p01", "skeleton", "right", skeleton, now_s)
        pen.write({name: (seconds, drawing) for name, drawing in drawings.items()})
        pen.write({name: (now_s, drawing) for name, drawing in picture.tick(now_s).items()})
    recording.flush()
    recording.disconnect()

    arm, elbow, lane, wrist_clears, names = [], [], [], 0, set()
    for chunk in RrdReader(path).stream():
        names.add(chunk.entity_path)
        batch = chunk.to_record_batch()
        columns = {
            name.split(":")[-1]: batch.column(name).to_pylist() for name in batch.schema.names if ":" in name
        }
        if chunk.is_static:
            continue
        if chunk.entity_path == "/world/p01/right":
            arm += list(zip(columns["translations"], columns["lengths"], strict=True))
        elif chunk.entity_path == "/angles/elbow_flexion/estimate/p01_right":
            elbow += [row[0] for row in columns["scalars"] if row]
        elif chunk.entity_path == "/quality/p01/hand_r":
            lane += [row[0] for row in columns["state"] if row]
        elif chunk.entity_path == "/angles/wrist_flexion/estimate/p01_right":
            wrist_clears += sum(bool(row) for row in columns.get("is_recursive", []))
    assert len(arm) == 30
    for translations, lengths in arm:
        assert len(translations) == len(lengths) == 6
        assert sorted(lengths)[3:] == pytest.approx(sorted([0.18, 0.26, 0.31]), abs=1e-6)
    expected = [np.degrees(arm_at(n / 30.0).angles["elbow_flexion"]) for n in range(30)]
    assert elbow == pytest.approx(expected, abs=1e-9)
    assert lane == ["good", "held"]  # once for each change, not for each skeleton
    assert wrist_clears == 1
    assert {"/world/p01/body", "/words", "/angles/elbow_flexion/reference", "/world/p01/name"} <= names


def test_what_breaks_the_thread_is_kept_for_the_loop(tmp_path):
    recording = rr.RecordingStream("brachium-test", recording_id="two")
    recording.save(tmp_path / "view.rrd")
    screen = Screen(recording)
    screen.mailbox.put(
        0.0, {"a": Capsules(np.zeros((2, 3)), np.zeros((3, 3)), np.zeros(1), np.zeros((1, 4)))}
    )
    screen.close(5.0)
    assert isinstance(screen.error, ValueError)
    recording.disconnect()
