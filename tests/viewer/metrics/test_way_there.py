"""The way there of movements whose begin, arrival and smoothness are known."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from brachium_viewer.exercises import EXERCISES
from brachium_viewer.metrics.repetitions import FLOOR_DEG, movement_set
from brachium_viewer.metrics.set_measures import SetMeasures, set_measures
from brachium_viewer.metrics.way_there import Way, way_there

RATE_HZ = 50.0
CURL = EXERCISES["elbow-flexion"]
GOLDEN_SPARC, GOLDEN_LDLJ = -1.406, -5.224
"""Of a minimum-jerk reach: LDLJ at 100 Hz, over 1 s; -ln 204.8 on paper."""
LEAD_S = 2.0


def reach(t: np.ndarray, from_s: float, seconds: float) -> np.ndarray:
    u = np.clip((t - from_s) / seconds, 0.0, 1.0)
    return u**3 * (10 - 15 * u + 6 * u * u)


def curls(
    *,
    count: int = 4,
    base: float = 10.0,
    way: float = 100.0,
    seconds: float = 1.0,
    hold_s: float = 1.0,
    stop: tuple[float, float] = (1.0, 0.0),
) -> tuple[np.ndarray, np.ndarray]:
    """Return times and angle of minimum-jerk repetitions with a stop on the way: at what part, how long."""
    part, stop_s = stop
    parts = [(part, seconds * part**0.5), (1.0 - part, seconds * (1.0 - part) ** 0.5)]
    each = sum(s for _, s in parts) + stop_s + hold_s + seconds + 1.0
    t = np.arange(0.0, LEAD_S + count * each + 1.0, 1.0 / RATE_HZ)
    angle = np.full_like(t, base)
    for i in range(count):
        now = LEAD_S + i * each
        for (share, s), rest in zip(parts, (stop_s, hold_s), strict=True):
            if share > 0.0:
                angle += way * share * reach(t, now, s)
            now += s + rest
        angle -= way * reach(t, now, seconds)
    return t, angle


def true_s(seconds: float, stop: tuple[float, float]) -> float:
    return seconds * (stop[0] ** 0.5 + (1.0 - stop[0]) ** 0.5) + stop[1]


def sway(t: np.ndarray, sd: float) -> np.ndarray:
    """Return a slow wandering up to 0.5 Hz."""
    random = np.random.default_rng(7)
    found = sum(np.sin(2 * np.pi * (f * t + random.uniform())) for f in np.linspace(0.08, 0.5, 12))
    return np.asarray(sd * found / np.std(found))


def tremor(t: np.ndarray, size: float = 2.0) -> np.ndarray:
    return size * np.sin(2 * np.pi * 5.0 * t)


def ways(t: np.ndarray, angle: np.ndarray) -> list[Way]:
    found = [way_there(t, angle, one) for one in movement_set(t, angle, FLOOR_DEG).repetitions]
    assert all(one is not None for one in found)
    return [one for one in found if one is not None]


def medians(motion_of, t: np.ndarray, angle: np.ndarray, name: str = "elbow-flexion") -> dict[str, float]:
    found: SetMeasures = set_measures(motion_of(t, {"elbow_flexion": angle}), EXERCISES[name])
    return {key: one.value for key, one in found.medians.items() if one.value is not None}


@pytest.mark.parametrize("seconds", [0.7, 1.0, 1.5, 2.0, 3.0, 4.0])
@pytest.mark.parametrize("hold_s", [0.0, 1.0])
def test_a_smooth_reach_has_its_own_length_and_the_published_smoothness(
    motion_of, seconds: float, hold_s: float
) -> None:
    t, angle = curls(seconds=seconds, hold_s=hold_s)
    found = medians(motion_of, t, angle)
    assert found["movement_time"] == pytest.approx(seconds, rel=0.05)
    assert found["mean_speed"] == pytest.approx(100.0 / seconds, rel=0.03)
    assert found["peak_speed"] == pytest.approx(187.5 / seconds, rel=0.01)
    assert found["sparc"] == pytest.approx(GOLDEN_SPARC, abs=0.006)
    assert found["ldlj"] == pytest.approx(GOLDEN_LDLJ, abs=0.2)
    for one, begin in zip(ways(t, angle), LEAD_S + (2 * seconds + hold_s + 1.0) * np.arange(4), strict=True):
        assert one.from_s == pytest.approx(begin, abs=0.03 * seconds)
        assert one.to_s == pytest.approx(begin + seconds, abs=0.03 * seconds)
        assert one.went == pytest.approx(100.0, abs=2.0)


@pytest.mark.parametrize("hold_s", [0.5, 1.0, 2.0, 3.0, 5.0])
def test_how_long_an_arm_holds_and_sways_changes_nothing(motion_of, hold_s: float) -> None:
    def measured(hold: float) -> SetMeasures:
        t, angle = curls(count=6, hold_s=hold)
        angle = angle + sway(t, 0.5)
        hand = np.stack([np.sin(np.radians(angle)), np.cos(np.radians(angle)), np.zeros_like(t)], axis=1)
        return set_measures(motion_of(t, {"elbow_flexion": angle}, hand=0.3 * hand), CURL, goal_deg=100.0)

    at_once = measured(0.0).medians
    limits = {"mean_speed": 0.03, "movement_time": 0.03, "time_to_goal": 0.03, "hand_path": 0.02}
    for one in measured(hold_s).repetitions:
        for name, limit in limits.items():
            assert one.measures[name].value == pytest.approx(at_once[name].value, rel=limit), name
        assert one.measures["sparc"].value == pytest.approx(at_once["sparc"].value, abs=0.005)
        assert one.measures["ldlj"].value == pytest.approx(at_once["ldlj"].value, abs=0.15)
        assert one.measures["straightness"].value == pytest.approx(at_once["straightness"].value, abs=0.01)


@pytest.mark.parametrize("part", [0.3, 0.5, 0.6, 0.7])
@pytest.mark.parametrize("stop_s", [0.3, 1.0, 2.0])
def test_a_stop_is_part_of_the_way(motion_of, part: float, stop_s: float) -> None:
    plain = medians(motion_of, *curls())
    stopped = medians(motion_of, *curls(stop=(part, stop_s)))
    assert stopped["movement_time"] == pytest.approx(true_s(1.0, (part, stop_s)), rel=0.13, abs=0.1)
    assert stopped["movement_time"] > plain["movement_time"] + stop_s
    assert stopped["sparc"] < plain["sparc"] - 0.5
    assert stopped["ldlj"] < plain["ldlj"] - 2.0
    assert stopped["mean_speed"] < 0.8 * plain["mean_speed"]
    assert stopped["range"] == pytest.approx(plain["range"], abs=0.1)


@pytest.mark.parametrize("way", [8.0, 20.0, 100.0])
@pytest.mark.parametrize("stop", [(1.0, 0.0), (0.6, 2.0)])
def test_a_tremor_decides_nothing_and_is_not_smooth(motion_of, way: float, stop: tuple[float, float]) -> None:
    t, angle = curls(way=way, base=40.0, seconds=2.0, stop=stop)
    plain, trembling = medians(motion_of, t, angle), medians(motion_of, t, angle + tremor(t))
    for name in ("movement_time", "mean_speed"):
        assert trembling[name] == pytest.approx(plain[name], rel=0.1), name
    for name in ("sparc", "ldlj"):
        assert trembling[name] < plain[name], name
    assert trembling["peak_speed"] > plain["peak_speed"] + 30.0  # the tremor's own


def test_a_way_down_is_a_way_there(motion_of) -> None:
    t, angle = curls()
    up, down = medians(motion_of, t, angle), medians(motion_of, t, 130.0 - angle, "elbow-extension")
    for name in ("movement_time", "mean_speed", "peak_speed", "sparc", "ldlj", "range"):
        assert down[name] == pytest.approx(up[name], rel=1e-6), name
    assert down["peak"] < down["start"]


@settings(deadline=None, max_examples=25)
@given(shift=st.floats(-60.0, 60.0), later=st.floats(0.0, 1e4), way=st.floats(40.0, 120.0))
def test_where_zero_is_and_how_far_it_goes_change_no_instant(shift: float, later: float, way: float) -> None:
    t, angle = curls(count=2, way=way, stop=(0.5, 0.5))
    plain, other = ways(t, angle), ways(t + later, shift + 1.2 * angle)
    for one, same in zip(plain, other, strict=True):
        assert same.from_s - later == pytest.approx(one.from_s, abs=0.03)
        assert same.to_s - later == pytest.approx(one.to_s, abs=0.03)


def test_who_was_under_way_when_it_began_to_be_seen_has_no_way_there(motion_of) -> None:
    t, angle = curls(count=3)
    seen = t > LEAD_S + 0.3
    found = set_measures(motion_of(t[seen], {"elbow_flexion": angle[seen]}), CURL).repetitions
    assert found[0].measures["movement_time"].withheld == "the way there has a gap or is too short"
    assert found[0].measures["hand_path"].value is None
    assert found[1].measures["movement_time"].value == pytest.approx(1.0, abs=0.05)


@pytest.mark.parametrize("gap_s", [0.06, 0.12, 0.2, 0.26, 0.44])
def test_smoothness_is_withheld_where_a_gap_may_hide_a_jerk(motion_of, gap_s: float) -> None:
    t, angle = curls(seconds=2.5)
    for begin in (0.1, 0.7, 1.2, 1.9):
        since = (t - LEAD_S) % 7.0 - begin
        motion = motion_of(
            t, {"elbow_flexion": np.where((since > 0.01) & (since < gap_s - 0.01), np.nan, angle)}
        )
        motion.quality["elbow_flexion"][np.isnan(motion.angles_deg["elbow_flexion"])] = "missing"
        for one in set_measures(motion, CURL).repetitions:
            assert one.measures["movement_time"].value == pytest.approx(2.5, rel=0.05)
            smooth = [one.measures[name] for name in ("sparc", "ldlj")]
            if gap_s > 0.21:
                assert all("a gap of 0." in m.withheld for m in smooth)
            else:
                assert smooth[0].value == pytest.approx(GOLDEN_SPARC, abs=0.01)
                assert smooth[1].value == pytest.approx(GOLDEN_LDLJ, abs=0.25)


@pytest.mark.parametrize("hold_s", [0.0, 1.0, 2.0, 5.0])
def test_the_sway_of_an_arm_that_hardly_moves_does_not_decide(motion_of, hold_s: float) -> None:
    t, angle = curls(count=12, way=8.0, base=40.0, seconds=2.0, hold_s=hold_s)
    found = medians(motion_of, t, angle + sway(t, 0.5))
    assert found["movement_time"] == pytest.approx(2.0, rel=0.15)
    assert found["mean_speed"] == pytest.approx(4.0, rel=0.15)


@pytest.mark.parametrize("period_s", [2.0, 4.0, 6.0])
def test_to_and_fro_without_a_rest_turns_at_both_ends(motion_of, period_s: float) -> None:
    t = np.arange(0.0, 2.0 + 5 * period_s + 2.0, 1.0 / RATE_HZ)
    phase = np.clip((t - 2.0) / period_s, 0.0, 5.0)
    found = set_measures(motion_of(t, {"elbow_flexion": 60.0 - 50.0 * np.cos(2 * np.pi * phase)}), CURL)
    assert len(found.repetitions) == 5
    for one in found.repetitions:
        assert one.measures["movement_time"].value == pytest.approx(0.5 * period_s, rel=0.1)
