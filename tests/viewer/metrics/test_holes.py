"""Times at which nothing came are rows of their own, as many as fit."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from brachium_viewer.exercises import EXERCISES
from brachium_viewer.metrics.arm_motion import ArmMotion, arm_motion
from brachium_viewer.metrics.even_grid import BRIDGED_S
from brachium_viewer.metrics.holes import MOST, NOTHING, unseen, with_holes
from brachium_viewer.metrics.set_measures import SetMeasures, set_measures, together
from brachium_wire.codec import encode
from brachium_wire.messages import Quality, SegmentPose, Skeleton
from brachium_wire.skeleton_columns import SkeletonCollector

RATE_HZ = 50.0
T = np.arange(0.0, 40.0, 1.0 / RATE_HZ)
CURL = EXERCISES["elbow-flexion"]


def curls(t: np.ndarray) -> np.ndarray:
    """Return six curls from 10 to 110 deg: two seconds up from 2 s on, two down, two of rest."""

    def eased(u: np.ndarray) -> np.ndarray:
        return 10 * u**3 - 15 * u**4 + 6 * u**5

    began = 2.0 + 6.0 * np.arange(6)[:, None]
    up, down = (eased(np.clip((t - began - late) / 2.0, 0.0, 1.0)) for late in (0.0, 2.0))
    return 10.0 + 100.0 * (up - down).sum(axis=0)


def recorded(kept: np.ndarray, sternum: np.ndarray | None = None, shoulder: Quality = "good") -> ArmMotion:
    """Return the motion of the curls whose skeletons at some instants never came."""
    collector = SkeletonCollector()
    for i in np.flatnonzero(kept).tolist():
        segments = {"upper_arm_r": SegmentPose(quality="good")}
        if sternum is not None:
            segments["sternum"] = SegmentPose(quality=str(sternum[i]))  # type: ignore[arg-type]
        angle = float(curls(T[i : i + 1])[0])
        one = Skeleton(
            time_ns=round(1e9 * T[i]),
            side="right",
            origin="worn",
            forward="elbow",
            trunk_from_world=(1.0, 0.0, 0.0, 0.0),
            segments=segments,
            positions={"shoulder": (0.2, 0.0, 0.0), "hand": (0.2, 0.003 * angle, 0.0)},
            angles={"elbow_flexion": float(np.radians(angle))},
            assumed={"shoulder": shoulder} if shoulder != "good" else {},
            shoulder_shift=(0.0, 0.0003 * angle, 0.0),
        )
        collector.take(encode(one), 0)
    return arm_motion(collector.columns())


def measures(kept: np.ndarray) -> SetMeasures:
    return set_measures(recorded(kept), CURL, goal_deg=100.0)


EVERY = np.ones(len(T), dtype=np.bool_)


def test_what_came_whole_is_as_it_came() -> None:
    whole = recorded(EVERY)
    assert whole.time_s == pytest.approx(T)
    assert measures(EVERY).measured == 1.0


def test_times_without_skeletons_are_times_not_measured() -> None:
    hole = (T > 10.0) & (T < 20.0)
    motion = recorded(~hole)
    assert motion.time_s == pytest.approx(T)
    assert (motion.quality["elbow_flexion"][hole] == "missing").all()
    assert np.isnan(motion.angles_deg["elbow_flexion"][hole]).all()
    assert np.isnan(motion.positions_m["hand"][hole]).all()
    assert motion.measured("elbow_flexion").mean() == pytest.approx(1.0 - hole.mean())
    assert measures(~hole).measured == pytest.approx(1.0 - hole.mean())
    assert measures(~hole).extension_deficit.coverage == pytest.approx(1.0 - hole.mean())


@pytest.mark.parametrize(("from_s", "to_s"), [(27.5, 32.5), (15.0, 17.2), (21.0, 21.7)])
def test_a_repetition_with_a_hole_is_withheld_whole(from_s: float, to_s: float) -> None:
    hole = (T - from_s > 0.0) & (T - to_s < 0.0)
    found, whole = measures(~hole), measures(EVERY)
    glued = [r for r in found.repetitions if r.from_s < to_s and r.to_s > from_s]
    withheld = [r for r in found.repetitions if r.measures["range"].value is None]
    assert found.tries == 0
    assert len(found.repetitions) - len(withheld) in (4, 5)
    for one in withheld:
        assert not any(m.value is not None for m in one.measures.values())
        said = {name: m.withheld for name, m in one.measures.items()}
        assert said.pop("trunk_lean") == "a sensor on the sternum gives it"
        assert all(f"not measured for {to_s - from_s:.1f} s" in why for why in said.values())
    assert all(r in withheld for r in glued)
    rest = [r for r in found.repetitions if r not in withheld]
    assert len(rest) >= 4
    for one in rest:
        same = min(whole.repetitions, key=lambda other: abs(other.peak_s - one.peak_s))
        assert one.measures["range"].value == pytest.approx(same.measures["range"].value, abs=0.5)


def test_what_nobody_asked_for_is_not_hidden_by_a_hole() -> None:
    found = set_measures(recorded(~((T > 15.0) & (T < 35.0))), CURL)
    assert {r.measures["time_to_goal"].withheld for r in found.repetitions} == {"no goal was set"}
    assert found.medians["time_to_goal"].withheld == "no goal was set"
    still = set_measures(recorded(T < 1.5), CURL)
    assert still.medians["time_to_goal"].withheld == "no goal was set"
    assert still.medians["range"].withheld == "no repetition"


def test_a_hole_that_is_bridged_leaves_the_repetition() -> None:
    found = measures(~((T > 20.6) & (T < 20.6 + 0.8 * BRIDGED_S)))
    assert [r.measures["range"].value is None for r in found.repetitions] == [False] * 6


def test_a_set_of_several_says_how_much_of_all_their_time_was_measured() -> None:
    half = measures(~((T > 15.0) & (T < 35.0)))
    assert together([half, measures(EVERY)], CURL).measured == pytest.approx(0.75, abs=0.01)


def test_the_shoulder_is_the_shoulder_where_the_trunk_is_measured_beside_it() -> None:
    worn = np.full(len(T), "good")
    for words, said in (
        (worn, "shoulder"),
        (np.where(T < 3.0, "good", "missing"), "shoulder or trunk movement"),
        (np.where(T < 30.0, "good", "missing"), "shoulder or trunk movement"),
        (np.full(len(T), "held"), "shoulder or trunk movement"),
    ):
        found = set_measures(recorded(EVERY, words), CURL)
        assert found.shoulder_word == said
        both = [set_measures(recorded(EVERY, worn), CURL), found]
        assert {together(order, CURL).shoulder_word for order in (both, both[::-1])} == {said}


def test_a_shift_that_is_known_at_other_times_does_not_lack_its_sensors() -> None:
    motion = recorded(EVERY)
    motion.shoulder_shift_m[T > 1.0] = np.nan
    assert set_measures(motion, CURL).medians["shoulder_shift"].withheld == "only 0 % of it was measured"
    motion.shoulder_shift_m[:] = np.nan
    assert "two sensors with raw samples" in set_measures(motion, CURL).medians["shoulder_shift"].withheld


def test_a_shift_that_is_assumed_is_not_measured() -> None:
    assert set_measures(recorded(EVERY), CURL).medians["shoulder_shift"].value is not None
    assert set_measures(recorded(EVERY, shoulder="assumed"), CURL).medians["shoulder_shift"].value is None


@given(
    st.lists(
        st.one_of(st.floats(0.01, 0.03), st.floats(0.6, 30.0), st.floats(86_400.0, 1e9)),
        min_size=1,
        max_size=60,
    )
)
def test_rows_grow_each_once_and_there_are_never_too_many(steps: list[float]) -> None:
    time_s = np.cumsum([0.0, *steps])
    times, rows = with_holes(time_s)
    assert len(times) <= 2 * len(time_s) + MOST
    assert (np.diff(times) > 0.0).all()
    assert rows[rows != NOTHING].tolist() == list(range(len(time_s)))
    assert times[rows != NOTHING].tolist() == time_s.tolist()


def test_a_hole_of_a_year_leaves_shorter_ones_as_they_are() -> None:
    time_s = np.concatenate([T, T + 45.0, T + 3e7])
    times, rows = with_holes(time_s)
    nothing = times[rows == NOTHING]
    assert ((nothing > 39.0) & (nothing < 45.0)).sum() == round((45.0 - T[-1]) * RATE_HZ) - 1
    assert (rows == NOTHING).sum() > len(time_s)


def test_what_is_unseen_is_from_what_is_known_to_what_is_known() -> None:
    known = np.ones(len(T), dtype=np.bool_)
    assert unseen(T, known) == []
    known[(T > 5.0) & (T < 7.0)] = False
    known[(T > 8.0) & (T < 8.0 + BRIDGED_S)] = False
    known[T < 3.0] = False
    assert np.array(unseen(T, known)) == pytest.approx(np.array([[0.0, 3.0], [5.0, 7.0]]))
