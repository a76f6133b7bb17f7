"""Filters: the wheel's own loop, state that can be put back, and the complementary filter judged by scipy."""

from math import radians

import msgpack
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation, Slerp
from vqf import VQF

from brachium_fusion.orientation import FILTERS, FilterName, OrientationFilter, make

RATE = 50.0
FIELD = np.array([0.0, 23.0, -40.0])
"""Magnetic north and down, uT."""
UP = np.array([0.0, 0.0, 9.81])


def scipy_of(q):
    return Rotation.from_quat(np.roll(q, -1, axis=-1))


def error_deg(q, truth):
    return np.degrees((scipy_of(q) * truth.inv()).magnitude())


def still(truth: Rotation, seconds: float):
    n = int(seconds * RATE)
    inverse = truth.inv()
    return np.zeros((n, 3)), np.tile(inverse.apply(UP), (n, 1)), np.tile(inverse.apply(FIELD), (n, 1))


def moving(truth: Rotation):
    """Return what a sensor with these (n,) orientations measures; the rate is that which led to each."""
    step = (truth[:-1].inv() * truth[1:]).as_rotvec() * RATE
    inverse = truth.inv()
    return np.vstack([step[:1], step]), inverse.apply(UP), inverse.apply(FIELD)


def slow_turn(seed: int, seconds: float) -> Rotation:
    random = np.random.default_rng(seed)
    marks = np.arange(0.0, seconds + 4.1, 4.0)
    poses = Rotation.from_euler(
        "ZXY", random.uniform([-180, -35, -50], [180, 35, 50], (len(marks), 3)), degrees=True
    )
    return Slerp(marks, poses)(np.arange(int(seconds * RATE)) / RATE)


def wandering(n: int = 300, seed: int = 3):
    random = np.random.default_rng(seed)
    gyr = np.cumsum(random.normal(0.0, 0.1, (n, 3)), axis=0)
    acc = np.array([1.0, 2.0, 9.0]) + random.normal(0.0, 1.0, (n, 3))
    return gyr, acc, np.array([20.0, -5.0, 30.0]) + random.normal(0.0, 3.0, (n, 3))


def sample_by_sample(gyr, acc, mag, rows, magnetometer: bool):
    wheel = VQF(1.0 / RATE)
    quats = []
    for i in range(len(gyr)):
        if i in rows:
            wheel.update(gyr[i], acc[i], mag[i])
        else:
            wheel.update(gyr[i], acc[i])
        quats.append(wheel.getQuat9D() if magnetometer else wheel.getQuat6D())
    return np.array(quats)


@pytest.mark.parametrize("magnetometer", [True, False])
@given(cuts=st.lists(st.integers(1, 60), min_size=1, max_size=8))
@settings(max_examples=15, deadline=None)
def test_vqf_in_any_batches_is_the_wheels_own_loop(magnetometer: bool, cuts: list[int]) -> None:
    gyr, acc, mag = (block[: sum(cuts)] for block in wandering(480))
    filter_ = make("vqf", 1.0 / RATE, magnetometer)
    got, at = [], 0
    for n in cuts:
        part = slice(at, at + n)
        got.append(filter_.update(gyr[part], acc[part], mag[part] if magnetometer else None, None))
        at += n
    wanted = sample_by_sample(gyr, acc, mag, range(at) if magnetometer else (), magnetometer)
    assert np.array_equal(np.concatenate(got), wanted)


@given(rows=st.sets(st.integers(0, 39)), first=st.integers(1, 39))
@settings(max_examples=25, deadline=None)
def test_a_magnetometer_with_few_values_is_the_loop_that_gives_it_where_it_is(rows: set[int], first: int):
    gyr, acc, mag = wandering(40)
    filter_ = make("vqf", 1.0 / RATE, True)
    got = []
    for start, end in ((0, first), (first, 40)):
        here = sorted(r for r in rows if start <= r < end)
        index = tuple(r - start for r in here)
        got.append(
            filter_.update(
                gyr[start:end], acc[start:end], mag[here] if here else None, index if here else None
            )
        )
    assert np.array_equal(np.concatenate(got), sample_by_sample(gyr, acc, mag, rows, True))


def test_a_magnetometer_that_is_left_aside_changes_nothing() -> None:
    gyr, acc, mag = wandering()
    for name in FILTERS:
        without = make(name, 1.0 / RATE, False).update(gyr, acc, None, None)
        aside = make(name, 1.0 / RATE, False).update(gyr, acc, mag, None)
        assert np.array_equal(without, aside), name


def test_auto_without_magnetometer_is_vqf() -> None:
    gyr, acc, mag = wandering()
    assert np.array_equal(
        make("auto", 1.0 / RATE, False).update(gyr, acc, mag, None),
        make("vqf", 1.0 / RATE, False).update(gyr, acc, None, None),
    )


def put_back(filter_: OrientationFilter, fresh: OrientationFilter) -> OrientationFilter:
    fresh.restore(msgpack.unpackb(msgpack.packb(filter_.state())))
    return fresh


@pytest.mark.parametrize("name", FILTERS)
@pytest.mark.parametrize("magnetometer", [True, False])
@pytest.mark.parametrize("cut", [0, 1, 137, 300])
def test_a_filter_put_back_goes_on_as_if_it_had_never_stopped(
    name: FilterName, magnetometer: bool, cut: int
) -> None:
    gyr, acc, mag = wandering()
    whole, first = make(name, 1.0 / RATE, magnetometer), make(name, 1.0 / RATE, magnetometer)
    wanted = whole.update(gyr, acc, mag, None)
    if cut:
        first.update(gyr[:cut], acc[:cut], mag[:cut], None)
    second = put_back(first, make(name, 1.0 / RATE, magnetometer))
    if cut < len(gyr):
        assert np.array_equal(second.update(gyr[cut:], acc[cut:], mag[cut:], None), wanted[cut:])
    assert second.disturbed == whole.disturbed


def test_a_disturbance_is_found_only_after_the_field_was_learnt_and_is_kept_in_the_state() -> None:
    """VQF learns the field from 5 s of movement."""
    gyr, acc, mag = moving(slow_turn(1, 40.0))
    filter_ = make("vqf", 1.0 / RATE, True)
    filter_.update(gyr[:50], acc[:50], mag[:50], None)
    assert not filter_.disturbed
    filter_.update(gyr[50:-100], acc[50:-100], mag[50:-100], None)
    assert not filter_.disturbed
    filter_.update(gyr[-100:], acc[-100:], mag[-100:] + np.array([60.0, 0.0, 0.0]), None)
    assert filter_.disturbed
    assert put_back(filter_, make("vqf", 1.0 / RATE, True)).disturbed


headings = st.floats(-180.0, 180.0)
pitches = st.floats(-80.0, 80.0)


@given(psi=headings, theta=pitches, phi=headings)
@settings(max_examples=60, deadline=None)
def test_corrected_knows_the_attitude_of_any_pose_at_rest_from_its_first_sample(psi, theta, phi) -> None:
    """T9, T11-T13: world_from_sensor is Z(psi) X(theta) Y(phi), +1 g up, heading 0 to the north."""
    truth = Rotation.from_euler("ZXY", [psi, theta, phi], degrees=True)
    quats = make("complementary", 1.0 / RATE, True).update(*still(truth, 0.2), None)
    assert error_deg(quats, truth).max() < 1e-6


@given(psi=headings, theta=pitches, phi=headings, start=st.tuples(headings, pitches, headings))
@settings(max_examples=25, deadline=None)
def test_corrected_comes_to_rest_at_the_true_attitude_wherever_it_was(psi, theta, phi, start) -> None:
    """T14: also across +-180 deg, the shorter way."""
    filter_ = make("complementary", 1.0 / RATE, True)
    filter_.update(*still(Rotation.from_euler("ZXY", start, degrees=True), 0.02), None)
    truth = Rotation.from_euler("ZXY", [psi, theta, phi], degrees=True)
    quats = filter_.update(*still(truth, 25.0), None)
    assert error_deg(quats[-1], truth) < 1e-6


def test_printed_misses_poses_at_rest_and_level_ones_too() -> None:
    """T11-T13: the sign of phi, the order and one sine of the heading's formula, and its north."""
    random = np.random.default_rng(1)
    errors = []
    for psi, theta, phi in random.uniform([-180, -60, -180], [180, 60, 180], (60, 3)):
        truth = Rotation.from_euler("ZXY", [psi, theta, phi], degrees=True)
        errors.append(
            error_deg(make("complementary-printed", 0.02, True).update(*still(truth, 0.1), None)[-1], truth)
        )
    assert np.median(errors) > 60.0
    tilted = Rotation.from_euler("Y", 0.66)
    phi = make("complementary-printed", 0.02, False).update(*still(tilted, 0.1), None)
    assert scipy_of(phi[-1]).as_euler("ZXY")[2] == pytest.approx(-0.66, abs=1e-9)


def test_printed_blends_plus_and_minus_180_through_zero_and_corrected_does_not() -> None:
    """T14."""
    before, after = (Rotation.from_euler("Y", angle, degrees=True) for angle in (179.0, -179.0))
    worst = {}
    for name in ("complementary", "complementary-printed"):
        filter_ = make(name, 1.0 / RATE, False)  # type: ignore[arg-type]
        start = filter_.update(*still(before, 1.0)[:2], None, None)[-1]
        turned = filter_.update(*still(after, 4.0)[:2], None, None)
        worst[name] = np.degrees((scipy_of(turned) * scipy_of(start).inv()).magnitude()).max()
    assert worst["complementary"] < 2.0 + 1e-6
    assert worst["complementary-printed"] > 150.0


@pytest.mark.parametrize("seed", range(4))
def test_corrected_follows_slow_turns_and_printed_does_not(seed: int) -> None:
    truth = slow_turn(seed, 40.0)
    gyr, acc, mag = moving(truth)
    corrected = make("complementary", 1.0 / RATE, True).update(gyr, acc, mag, None)
    printed = make("complementary-printed", 1.0 / RATE, True).update(gyr, acc, mag, None)
    assert np.sqrt(np.mean(error_deg(corrected, truth) ** 2)) < 1.5
    assert np.sqrt(np.mean(error_deg(printed, truth) ** 2)) > 20.0


@pytest.mark.parametrize("name", ["vqf", "complementary"])
@given(turn=st.floats(-300.0, 300.0))
@settings(max_examples=10, deadline=None)
def test_without_magnetometer_the_heading_is_what_the_gyroscope_says(name: FilterName, turn: float) -> None:
    """Unwrapped over more than half a turn, starting at 0."""
    if name == "vqf":  # slower than 2 deg/s it takes for rest, and the rate for a bias
        turn = float(np.copysign(120.0 + abs(turn), turn))
    angles = np.linspace(0.0, turn, 500)
    gyr, acc, _ = moving(Rotation.from_euler("z", angles[:, None], degrees=True))
    gyr[0] = 0.0
    quats = make(name, 1.0 / RATE, False).update(gyr, acc, None, None)
    heading = np.unwrap(scipy_of(quats).as_euler("ZXY")[:, 0])
    assert np.degrees(heading) == pytest.approx(angles, abs=0.2)


@pytest.mark.parametrize("axis", ["Z", "Y"])
def test_corrected_turns_across_180_without_a_jump(axis: str) -> None:
    angles = np.linspace(150.0, 210.0, 300)
    truth = Rotation.from_euler(axis, angles[:, None], degrees=True)
    quats = make("complementary", 1.0 / RATE, True).update(*moving(truth), None)
    assert error_deg(quats, truth).max() < 0.5
    steps = (scipy_of(quats[1:]) * scipy_of(quats[:-1]).inv()).magnitude()
    assert np.degrees(steps).max() < 0.5


def test_the_singular_pose_of_a_hanging_arm_gives_numbers() -> None:
    """T15: sensor Y vertical."""
    for name in FILTERS:
        truth = Rotation.from_euler("ZXY", [0.0, 90.0, 0.0], degrees=True)
        gyr, acc, mag = still(truth, 2.0)
        gyr[:] = radians(20.0)
        quats = make(name, 1.0 / RATE, True).update(gyr, acc, mag, None)
        assert np.linalg.norm(quats, axis=1) == pytest.approx(1.0, abs=1e-9), name
