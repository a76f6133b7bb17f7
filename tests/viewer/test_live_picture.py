from itertools import pairwise

import msgspec
import pytest

from brachium_viewer.drawings import Capsules, Degrees, Label, Lane, Layout, Range, Text
from brachium_viewer.picture import MAX_SUBJECTS, SETTLE_S, SILENT_S, Picture
from brachium_viewer.scene import PLOTS, SPACING
from brachium_wire.messages import Calibration, Status

PRESENT = 1_700_000_000_000_000_000


def feed(picture, skeleton, now_s, subject="p01", topic="skeleton"):
    moment = picture.feed(subject, topic, skeleton.side, skeleton, now_s)
    assert moment is not None
    return moment


def test_before_the_first_skeleton_there_are_words_and_then_the_arm_at_once(arm_at):
    picture = Picture()
    assert picture.feed("p01", "calibration", "", Calibration(time_ns=1, state="waiting"), 0.1) is None
    waiting = picture.tick(0.1)
    assert waiting.keys() == {"layout", "words"}
    assert "Waiting for skeletons" in waiting["words"].markdown
    assert picture.tick(0.2) == {}
    feed(picture, arm_at(0), 0.3)
    assert picture.tick(0.3)["layout"].arms


def test_measured_time_is_kept_and_recordings_of_another_day_begin_now(arm_at):
    picture = Picture()
    times = [
        feed(picture, arm_at(0, time_ns=PRESENT + n * 20_000_000), 3.0 + 0.02 * n + 0.003)[0]
        for n in range(50)
    ]
    assert times[0] == pytest.approx(3.003)
    assert [b - a for a, b in pairwise(times)] == pytest.approx([0.02] * 49, abs=1e-6)
    old = feed(picture, arm_at(0, time_ns=PRESENT - 400 * 86_400_000_000_000), 4.5, subject="p02")
    assert old[0] == pytest.approx(4.5)


def test_the_truth_stays_level_with_the_estimate_that_comes_later(arm_at):
    picture = Picture()
    truth = feed(picture, arm_at(0, time_ns=PRESENT), 1.0, topic="truth")[0]
    estimate = feed(picture, arm_at(0, time_ns=PRESENT), 1.2)[0]
    assert estimate == truth


def test_a_stream_that_jumps_is_shown_where_it_arrives(arm_at):
    picture = Picture()
    feed(picture, arm_at(0, time_ns=PRESENT), 1.0)
    assert feed(picture, arm_at(0, time_ns=PRESENT + 60_000_000_000), 2.0)[0] == pytest.approx(2.0)


def test_panels_are_arranged_at_once_and_again_only_when_newcomers_have_settled(arm_at):
    picture = Picture()
    feed(picture, arm_at(0), 0.0)
    first = picture.tick(0.0)["layout"]
    assert isinstance(first, Layout)
    assert [arm.path for arm in first.arms] == ["estimate/p01_right"]
    assert first.angles == tuple(plot.angle for plot in PLOTS)
    assert "layout" not in picture.tick(10.0)
    feed(picture, arm_at(0, side="left"), 11.0)
    feed(picture, arm_at(0), 11.0, topic="truth")
    assert "layout" not in picture.tick(11.0 + 0.5 * SETTLE_S)
    second = picture.tick(11.1 + SETTLE_S)["layout"]
    assert [arm.path for arm in second.arms] == [
        "estimate/p01_right",
        "estimate/p01_left",
        "actual/p01_right",
    ]


def test_only_angles_that_exist_get_a_plot_and_its_reference(arm_at):
    picture = Picture()
    whole = arm_at(0)
    feed(picture, msgspec.structs.replace(whole, angles={"elbow_flexion": 1.0, "theta4": 1.0}), 0.0)
    drawn = picture.tick(0.0)
    assert drawn["layout"].angles == ("elbow_flexion",)
    assert {path for path in drawn if path.startswith("angles/")} == {"angles/elbow_flexion/reference"}
    assert drawn["angles/elbow_flexion/reference"] == Range(0.0, 150.0)


def test_the_body_is_drawn_once_while_the_trunk_keeps_still(arm_at):
    picture = Picture()
    bodies = ["world/p01/body" in feed(picture, arm_at(0.02 * n), 0.02 * n)[1] for n in range(20)]
    assert bodies == [True] + [False] * 19
    leaning = arm_at(0.5, trunk_from_world=(0.96891242, 0.24740396, 0.0, 0.0))
    assert "world/p01/body" in feed(picture, leaning, 0.5)[1]


def test_a_stream_that_stops_is_shown_so_once_and_comes_back(arm_at):
    picture = Picture()
    feed(picture, arm_at(0), 0.0)
    feed(picture, arm_at(0, side="left"), 0.4)
    assert not [path for path in picture.tick(SILENT_S) if path.startswith("world/p01/right")]
    drawn = picture.tick(SILENT_S + 0.1)
    assert isinstance(drawn["world/p01/right"], Capsules)
    assert drawn["angles/elbow_flexion/estimate/p01_right"] == Degrees(None)
    assert drawn["quality/p01/hand_r"] == Lane("silent")
    assert "world/p01/left" not in drawn  # the other arm still comes
    assert "world/p01/right" not in picture.tick(SILENT_S + 0.2)
    assert feed(picture, arm_at(0.1), 1.5)[1]["quality/p01/hand_r"] == Lane("good")
    assert "world/p01/right" in picture.tick(1.6 + SILENT_S)


@pytest.mark.parametrize(
    ("origin", "words", "label"),
    [
        ("emulated", "EMULATED WEARER", "p01: emulated wearer"),
        ("playback", "PLAYBACK", "p01: playback"),
        ("worn", "worn", "p01"),
    ],
)
def test_the_origin_is_told_plainly_in_words_picture_and_title(arm_at, origin, words, label):
    picture = Picture()
    feed(picture, arm_at(0, origin=origin), 0.0)
    drawn = picture.tick(0.0)
    text, name, layout = drawn["words"], drawn["world/p01/name"], drawn["layout"]
    assert isinstance(text, Text)
    assert isinstance(name, Label)
    assert words in text.markdown
    assert name.text == label
    assert ("(" in layout.title) == (origin != "worn")
    assert "not a medical device" in text.markdown


def test_calibration_heading_and_sensors_stand_in_words(arm_at):
    picture = Picture()
    refused = Calibration(
        time_ns=1, state="refused", pose="neutral", reason="forearm_r moved: stand still for 3 s"
    )
    # Retained ones come before the first skeleton.
    picture.feed("p01", "calibration", "", refused, 0.0)
    feed(picture, arm_at(0), 0.0)
    status = Status(node="n", time_ns=1, connected=True, received=900, lost=100, out_of_order=0, rate_hz=99.6)
    picture.feed("p01", "status", "forearm_r", status, 0.0)
    text = picture.tick(0.0)["words"].markdown
    assert r"forearm\_r moved: stand still for 3 s" in text
    assert "stated facing" in text
    assert "| forearm r | 100 | 10.00 % | – | – |" in text


def test_words_from_the_network_are_words_and_nothing_else(arm_at):
    picture = Picture()
    evil = "![x](http://evil.example/x.png) <img src=y> `code` | # head\n# head " + 500 * "long"
    refused = Calibration(time_ns=1, state="refused", reason=evil, warnings=100 * [evil])
    picture.feed("p01", "calibration", "", refused, 0.0)
    feed(picture, arm_at(0), 0.0)
    text = picture.tick(0.0)["words"].markdown
    assert r"\!\[x\]\(http:\/\/evil.example\/x.png\) \<img src\=y\> \`code\` \| \# head \# head" in text
    assert "](" not in text
    assert "<img" not in text.replace(r"\<img", "")
    assert text.count("…") == 9  # the reason and eight warnings, each cut
    assert len(text) < 4000


def test_a_flood_of_subjects_segments_and_statuses_fills_no_memory(arm_at):
    picture = Picture()
    status = Status(node="n", time_ns=1, connected=True, received=1, lost=0, out_of_order=0)
    made_up = {f"tail_{n}": next(iter(arm_at(0).segments.values())) for n in range(50)}
    odd = msgspec.structs.replace(arm_at(0), segments=made_up)
    assert not [path for path in feed(picture, odd, 0.0, subject="s0")[1] if path.startswith("quality/")]
    for n in range(1, 100):
        picture.feed(f"s{n}", "calibration", "", Calibration(time_ns=1, state="done"), 0.0)
        picture.feed(f"s{n}", "skeleton", "right", arm_at(0), 0.0)
        picture.feed("s0", "status", f"tail_{n}", status, 0.0)
    drawn = picture.tick(0.0)
    assert sum(path.endswith("/name") for path in drawn) == MAX_SUBJECTS
    assert "tail" not in drawn["words"].markdown
    assert picture.turned_away == 2 * (100 - MAX_SUBJECTS)


def test_subjects_stand_side_by_side_in_order_of_appearance(arm_at):
    picture = Picture()
    first = feed(picture, arm_at(0), 0.0, subject="p07")[1]["world/p07/right"]
    second = feed(picture, arm_at(0), 0.0, subject="p01")[1]["world/p01/right"]
    assert second.starts[0, 0] - first.starts[0, 0] == pytest.approx(-SPACING)  # on the right as we face them
    drawn = picture.tick(0.0)
    assert {"world/p07/name", "world/p01/name"} <= drawn.keys()
    assert "light blue = p07 right, orange = p01 right, grey = AAOS reference" in drawn["words"].markdown
