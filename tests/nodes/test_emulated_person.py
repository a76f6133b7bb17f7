"""The emulated wearer's body: ranges as stated, smooth for ever, bones of constant length."""

import numpy as np
import pytest

from brachium_body.angles import INDEX
from brachium_nodes.desk import RADIUS_M, RECTANGLE_M
from brachium_nodes.exercises import EXERCISES
from brachium_nodes.movement import Variation, eased, minimum_jerk
from brachium_nodes.person import NEUTRAL_S, Person, PersonSettings
from brachium_nodes.wearer import Wearer, WearerSettings

SETTLED_S = 8.0
EXTENT = 0.025  # of the way from base to peak, by which a repetition may differ


def column(exercise: str, name: str, **other: object) -> np.ndarray:
    t = np.arange(SETTLED_S, 120.0, 0.02)
    wearer = Wearer(WearerSettings(exercise=exercise, **other))  # type: ignore[arg-type]
    return np.degrees(wearer.truth(t, "right").angles[:, INDEX[name]])


@pytest.mark.parametrize(
    ("exercise", "name", "base", "peak"),
    [
        ("elbow-flexion", "elbow_flexion", 8, 88),
        ("shoulder-abduction", "shoulder_abduction", 8, 80),
        ("shoulder-abduction-high", "shoulder_abduction", 8, 150),
        ("wrist-flexion", "wrist_flexion", -25, 55),
        ("wrist-flexion", "elbow_flexion", 90, 90),
        ("wrist-flexion", "forearm_pronation", 0, 0),
        ("reaching", "elbow_flexion", 100, 25),
        ("forearm-rotation", "forearm_pronation", -60, 60),
        ("scapular-elevation", "isb_elevation", 5, 120),
        ("horizontal-abduction", "isb_plane", 115, -15),
        ("external-rotation", "shoulder_rotation", 60, -50),
        ("external-rotation", "elbow_flexion", 90, 90),
    ],
)
def test_every_repetition_goes_as_far_as_its_exercise_states(
    exercise: str, name: str, base: float, peak: float
) -> None:
    shoulder = name.startswith(("shoulder", "isb"))  # the shoulder sways by 0.2 deg (sd) besides
    slack = EXTENT * abs(peak - base) + (0.8 if shoulder else 0.01)
    values = column(exercise, name, seed=11)
    first, last = (values.min(), values.max()) if base <= peak else (values.max(), values.min())
    assert abs(first - base) <= (0.8 if shoulder else 0.01)
    assert abs(last - peak) <= slack


def test_scapular_elevation_stays_in_its_plane() -> None:
    plane, elevation = (
        column("scapular-elevation", "isb_plane"),
        column("scapular-elevation", "isb_elevation"),
    )
    assert np.abs(plane[elevation > 60.0] - 35.0).max() < 2.0


@pytest.mark.parametrize(("exercise", "axis", "way"), [("shrugging", 2, 0.08), ("protraction", 1, 0.12)])
def test_the_shoulder_moves_as_far_as_stated(exercise: str, axis: int, way: float) -> None:
    t = np.arange(SETTLED_S, 60.0, 0.02)
    shift = Wearer(WearerSettings(exercise=exercise)).truth(t, "right").shoulder_shift[:, axis]
    assert np.ptp(shift) == pytest.approx(way, rel=EXTENT)


@pytest.mark.parametrize("height", [1.4, 1.8, 2.3])
@pytest.mark.parametrize("carrying", [0.0, 12.0])
@pytest.mark.parametrize("side", ["right", "left"])
def test_the_wrist_draws_circle_and_rectangle_on_a_level_desk(
    height: float, carrying: float, side: str
) -> None:
    t = np.arange(SETTLED_S, 60.0, 0.02)

    def wrist(exercise: str) -> np.ndarray:
        made = WearerSettings(exercise=exercise, height_m=height, carrying_deg=carrying, arms=side)  # type: ignore[arg-type]
        return Wearer(made).truth(t, side).positions["wrist"]  # type: ignore[arg-type]

    path = wrist("circle")
    assert np.ptp(path[:, 2]) < 1e-9
    middle = 0.5 * (path.min(axis=0) + path.max(axis=0))
    assert np.linalg.norm(path - middle, axis=1) == pytest.approx(np.full(len(t), RADIUS_M), rel=0.05)
    path = wrist("rectangle")
    assert np.ptp(path, axis=0) == pytest.approx([*RECTANGLE_M, 0.0], abs=1e-9)
    off = np.abs(path - 0.5 * (path.min(axis=0) + path.max(axis=0)))[:, :2] - 0.5 * np.array(RECTANGLE_M)
    assert np.abs(off.max(axis=1)).max() < 1e-9  # always on one of the sides


@pytest.mark.parametrize("exercise", EXERCISES)
def test_bones_keep_their_lengths(exercise: str) -> None:
    person = Person(
        PersonSettings(exercise=exercise, arms="both", height_m=1.65, carrying_deg=8.0, sway_deg=5.0)
    )
    joints = person.arm(np.arange(0.0, 60.0, 0.05), "left").joints
    for near, far, length in (
        ("shoulder", "elbow", 0.186 * 1.65),
        ("elbow", "wrist", 0.146 * 1.65),
        ("wrist", "hand", 0.108 * 1.65),
    ):
        assert np.abs(np.linalg.norm(joints[far] - joints[near], axis=1) - length).max() < 1e-12


@pytest.mark.parametrize("exercise", EXERCISES)
def test_motion_is_smooth_from_standing_still_on(exercise: str) -> None:
    step = 5e-4
    person = Person(PersonSettings(exercise=exercise, seed=7, sway_deg=2.0))
    hand = person.arm(np.arange(NEUTRAL_S - 0.1, 40.0, step), "right").joints["hand"]
    acceleration = np.diff(hand, 2, axis=0) / step**2
    # A jump of 1 mm/s in velocity anywhere would show as 2 m/s^2 here; the worst tremor is smooth.
    assert np.abs(np.diff(acceleration, axis=0)).max() < 0.4
    assert np.abs(acceleration).max() > 0.5


@pytest.mark.parametrize("exercise", EXERCISES)
def test_the_person_stands_perfectly_still_at_first_and_moves_for_ever(exercise: str) -> None:
    person = Person(PersonSettings(exercise=exercise, sway_deg=2.0))
    still = person.arm(np.linspace(0.0, NEUTRAL_S, 50), "right").joints["hand"]
    assert (still == still[0]).all()
    late = person.arm(1e6 + np.linspace(0.0, 30.0, 300), "right").joints["hand"]
    assert np.ptp(late, axis=0).max() > 0.05


def test_repetitions_differ_a_little_and_with_the_seed() -> None:
    t = np.arange(SETTLED_S, 200.0, 0.01)

    def peaks(seed: int) -> np.ndarray:
        elbow = np.degrees(Person(PersonSettings(seed=seed)).posture(t, "right").angles["elbow_flexion"])
        top = (elbow[1:-1] > elbow[:-2]) & (elbow[1:-1] >= elbow[2:]) & (elbow[1:-1] > 80.0)
        return elbow[1:-1][top]

    assert 40 <= len(peaks(1)) <= 60
    assert 0.5 < np.ptp(peaks(1)) <= 80.0 * 2 * EXTENT
    assert abs(peaks(1)[0] - peaks(2)[0]) > 1e-3


def test_random_movement_pauses() -> None:
    t = np.arange(SETTLED_S, 100.0, 0.01)
    hand = Person(PersonSettings(exercise="free")).arm(t, "right").joints["hand"]
    still = np.linalg.norm(np.diff(hand, axis=0), axis=1) < 1e-9
    assert 0.05 < still.mean() < 0.3


def test_repetitions_follow_one_another_without_gap_or_overlap() -> None:
    number, fraction = Variation(3).repetitions(np.arange(-2.0, 400.0, 0.01), 4.0)
    assert set(np.diff(number)) == {0.0, 1.0}
    assert number[0] == 0
    assert fraction[0] == 0.0
    new = np.diff(number) == 1.0
    assert (np.diff(fraction)[~new] >= 0.0).all()
    assert fraction[1:][new].max() < 0.01
    assert fraction[:-1][new].min() > 0.99


def test_random_numbers_are_even_and_apart() -> None:
    draw = Variation(0).uniform("a", np.arange(20_000))
    assert np.histogram(draw, 10, (0.0, 1.0))[0] == pytest.approx(np.full(10, 2000), rel=0.1)
    for other in (Variation(1), Variation(0, "left")):
        assert abs(np.corrcoef(draw, other.uniform("a", np.arange(20_000)))[0, 1]) < 0.03
    assert abs(np.corrcoef(draw[1:], draw[:-1])[0, 1]) < 0.03
    assert Variation(0).uniform("a", 17) == draw[17]


def test_minimum_jerk_starts_and_ends_at_rest_and_eased_is_its_integral() -> None:
    u = np.linspace(-0.5, 1.5, 20_001)
    step = minimum_jerk(u)
    for order in (1, 2):
        rate = np.diff(step, order) / 1e-4**order
        assert np.abs(rate[[0, -1]]).max() == 0.0
        assert np.abs(np.diff(rate)).max() < 0.01
    integral = np.concatenate([[0.0], np.cumsum(0.5 * (step[1:] + step[:-1])) * 1e-4])
    assert np.abs(0.7 * integral - eased(0.7 * u, 0.7)).max() < 1e-8


@pytest.mark.parametrize("extent", [0.0, 0.1, 1.0])
def test_an_exercise_can_be_done_in_small(extent: float) -> None:
    t = np.arange(SETTLED_S, 30.0, 0.02)
    full, small = (
        Person(PersonSettings(exercise="shrugging", extent=part)).posture(t, "right")
        for part in (1.0, extent)
    )
    np.testing.assert_allclose(small.shift, extent * full.shift)
    np.testing.assert_allclose(small.angles["elbow_flexion"], extent * full.angles["elbow_flexion"])
    with pytest.raises(ValueError, match=r"give 0 to 1\.2"):
        PersonSettings(extent=2.0)
