"""The emulated sensors against independent judges: scipy integrates, statistics find the errors."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid
from scipy.signal import lsim
from scipy.spatial.transform import Rotation

from brachium_body.rotation import angle_between
from brachium_nodes import tissue
from brachium_nodes.mounting import Worn
from brachium_nodes.person import Person, PersonSettings
from brachium_nodes.sensors import (
    ACCEL_FULL_SCALE,
    GYRO_FULL_SCALE,
    GYRO_STEP,
    LEVELS,
    MAG_FULL_SCALE,
    Chip,
    Errors,
    G,
    calibrated,
)
from brachium_nodes.wearer import Wearer, WearerSettings

EVERYWHERE = ("sternum", "upper_arm_r", "forearm_r", "hand_r", "upper_arm_l", "forearm_l", "hand_l")
STILL = 390  # samples at 100 Hz before anything moves
MOVING = (
    ("reaching", "hand_r"),
    ("forearm-rotation", "forearm_l"),
    ("shoulder-abduction-high", "hand_l"),
    ("shrugging", "upper_arm_r"),
    ("circle", "forearm_r"),
    ("drinking", "hand_r"),
    ("free", "upper_arm_l"),
    ("free", "sternum"),
)


def wearer(**settings: object) -> Wearer:
    return Wearer(WearerSettings(**settings))  # type: ignore[arg-type]


@pytest.mark.parametrize("segment", EVERYWHERE)
def test_a_still_sensor_reads_g_upward_and_the_field(segment: str) -> None:
    r = wearer(level="exact", segments=(segment,)).samples(segment, 0, STILL)  # type: ignore[arg-type]
    assert np.abs(r.acc - [0.0, G, 0.0]).max() < 1e-6  # y along the segment, which hangs
    assert np.abs(r.gyr).max() < 1e-9
    forward = (
        2 if segment == "sternum" else 0
    )  # z off the chest; x forward on a right arm, backward on a left
    north = np.array([0.0, -46.0 * np.sin(np.radians(60.0)), 0.0])
    north[forward] = 23.0 * (-1.0 if segment.endswith("_l") else 1.0)
    assert np.abs(r.mag - north).max() < 1e-9


def integrated(r: object, period_s: float, first: Rotation) -> tuple[Rotation, np.ndarray]:
    """Return orientations and displacement (n, 3) from rates and forces alone, with scipy's rotations."""
    rates = 0.5 * (r.gyr[1:] + r.gyr[:-1])  # type: ignore[attr-defined]
    # Coning: the product of neighbouring rates turns a trapezoid into a rotation vector (Bortz 1971).
    coning = np.cross(r.gyr[:-1], r.gyr[1:]) * period_s**2 / 12.0  # type: ignore[attr-defined]
    steps = Rotation.from_rotvec(rates * period_s + coning)
    orientations = [first]
    for step in steps:
        orientations.append(orientations[-1] * step)
    world = Rotation.concatenate(orientations)
    acceleration = world.apply(r.acc) - [0.0, 0.0, G]  # type: ignore[attr-defined]
    velocity = cumulative_trapezoid(acceleration, dx=period_s, axis=0, initial=0.0)
    return world, cumulative_trapezoid(velocity, dx=period_s, axis=0, initial=0.0)


@pytest.mark.parametrize(("exercise", "segment"), MOVING)
def test_integrating_exact_samples_gives_back_the_motion(exercise: str, segment: str) -> None:
    rate, count = 500.0, 7000
    w = wearer(
        level="exact", exercise=exercise, arms="both", sway_deg=3.0, rate_hz=rate, segments=(segment,), seed=8
    )
    r = w.samples(segment, 0, count)  # type: ignore[arg-type]
    q, p = Worn.put_on(segment, w.person, LEVELS["exact"]).pose(r.time_s, w.person)  # type: ignore[arg-type]
    first = Rotation.from_quat(q[0], scalar_first=True)
    world, displacement = integrated(r, w.clocks[segment].period_s, first)  # type: ignore[index]
    assert np.degrees(angle_between(world.as_quat(scalar_first=True), q)).max() < 0.005
    assert np.abs(displacement - (p - p[0])).max() < 2e-3
    assert np.ptp(p, axis=0).max() > 0.02


def test_the_skins_wobble_is_in_rates_and_forces_and_leaves_nothing_behind() -> None:
    person = Person(PersonSettings(exercise="reaching", seed=2))
    worn = Worn.put_on("forearm_r", person, LEVELS["typical"])
    period = 0.002
    t = np.arange(0.0, 14.0, period)

    class Rows:
        acc, gyr, _ = worn.truth(t, period, person)

    q, p = worn.pose(t, person)
    world, displacement = integrated(Rows, period, Rotation.from_quat(q[0], scalar_first=True))
    off = np.degrees(angle_between(world.as_quat(scalar_first=True), q))
    assert 0.2 < off.max() < 6.0  # what wobbles
    away = np.linalg.norm(displacement - (p - p[0]), axis=1)
    assert 2e-4 < away.max() < 2e-2
    resting = (t > 9.6) & (t < 10.4) & (np.linalg.norm(np.gradient(p, period, axis=0), axis=1) < 1e-3)
    assert off[resting].min() < 0.15
    shift = tissue.wobble(np.ones((3000, 3)), period)[0]
    assert np.abs(shift[-1] + 1.0 / (2.0 * np.pi * tissue.WOBBLE_HZ) ** 2).max() < 1e-9


def test_wobble_is_the_damped_oscillator_it_says() -> None:
    t = np.arange(0.0, 3.0, 0.01)
    drive = np.stack([np.sin(7.0 * t), np.cos(3.0 * t), t * np.exp(-t)], axis=-1)
    shift, velocity, acceleration = tissue.wobble(drive, 0.01)
    w = 2.0 * np.pi * tissue.WOBBLE_HZ
    a, b = [[0.0, 1.0], [-w * w, -2.0 * tissue.DAMPING * w]], [[0.0], [1.0]]
    for axis in range(3):
        _, _, state = lsim((a, b, np.eye(2), np.zeros((2, 1))), -drive[:, axis], t)
        # A first row that is not 0 is a step here and a ramp of one sample there.
        assert np.abs(shift[100:, axis] - state[100:, 0]).max() < 1e-8
        assert np.abs(velocity[100:, axis] - state[100:, 1]).max() < 1e-6
    assert np.abs(np.gradient(velocity[:, 0], t) - acceleration[:, 0])[5:-5].max() < 0.05


def still_chips(count: int = 60, rate: float = 100.0) -> tuple[np.ndarray, ...]:
    """Return for many chips lying still, rows acc, gyr, mag: the means (count, 3, 3) of calibrated and of raw
    readings, the standard deviations of calibrated ones, and what would be true."""
    done, raw, noise, true = [], [], [], []
    for seed in range(count):
        w = wearer(seed=seed, rate_hz=rate, segments=("hand_r",))
        r = w.samples("hand_r", 0, int(3.9 * rate))
        worn = Worn.put_on("hand_r", w.person, LEVELS["ideal"])
        exact = worn.truth(r.time_s[:2], 1.0 / rate, w.person)
        cal = calibrated(w.info("hand_r").calibration, r.acc, r.gyr, r.mag)
        done.append([x.mean(axis=0) for x in cal])
        noise.append([x.std(axis=0) for x in cal])
        raw.append([x.mean(axis=0) for x in (r.acc, r.gyr, r.mag)])
        true.append([x[0] for x in exact])
    return np.array(done), np.array(raw), np.array(noise), np.array(true)


def test_calibration_undoes_raw_errors_down_to_the_residuals() -> None:
    done, raw, _, true = still_chips()
    e = LEVELS["ideal"]
    left, before = (done - true).std(axis=(0, 2)), (raw - true).std(axis=(0, 2))
    along_g = e.accel_scale_residual * G / np.sqrt(3.0)
    assert left[0] == pytest.approx(np.hypot(e.accel_bias_residual, along_g), rel=0.2)
    assert left[1] == pytest.approx(e.gyro_bias_residual, rel=0.2)
    assert left[2] == pytest.approx(e.hard_iron_residual, rel=0.2)
    assert (before / left > 10.0).all()
    assert before[1] == pytest.approx(e.gyro_bias_raw, rel=0.2)


@pytest.mark.parametrize("rate", [25.0, 100.0, 400.0])
def test_noise_has_the_stated_density(rate: float) -> None:
    _, _, noise, _ = still_chips(12, rate)
    e, band = LEVELS["ideal"], np.sqrt(rate / 2.0)
    acc, gyr, mag = np.sqrt((noise**2).mean(axis=(0, 2)))
    assert acc == pytest.approx(e.accel_noise * band, rel=0.06)
    steps = GYRO_STEP / np.sqrt(12.0)  # wide enough to be seen
    assert gyr == pytest.approx(np.hypot(e.gyro_noise * band, steps), rel=0.06)
    assert mag == pytest.approx(e.mag_noise, rel=0.06)


def test_the_gyros_bias_walks_as_far_as_stated() -> None:
    def bias(seed: int, second: int) -> np.ndarray:
        w = wearer(seed=seed, rate_hz=10.0, segments=("hand_l",))  # the left arm hangs for ever
        r = w.samples("hand_l", 10 * second, 100)
        return calibrated(w.info("hand_l").calibration, r.acc, r.gyr, r.mag)[1].mean(axis=0)

    hours = np.array([bias(seed, 7200) - bias(seed, 0) for seed in range(30)])
    assert hours.std() == pytest.approx(LEVELS["ideal"].gyro_walk * np.sqrt(7200.0), rel=0.25)


def test_the_walk_goes_on_where_a_page_of_it_ends() -> None:
    page_s = 4096  # a block is one second
    jumps = []
    for seed in range(20):
        gyr = wearer(seed=seed, rate_hz=1.0, segments=("hand_l",)).samples("hand_l", page_s - 12, 24).gyr
        jumps.append(gyr[12:].mean(axis=0) - gyr[:12].mean(axis=0))
    # A walk that began anew would be off by 0.13 dps here.
    assert np.degrees(np.std(jumps)) < 0.03


def test_readings_stop_at_full_scale_and_come_in_steps() -> None:
    chip = Chip.draw(LEVELS["ideal"], 1, "hand_r")
    far = np.array([[1e3, -1e3, 0.0]])
    acc, gyr, mag = chip.read(far, far, 10.0 * far, 100.0, np.zeros((1, 3)), np.zeros((3, 1, 3)))
    assert np.abs(acc[0, :2]) == pytest.approx(ACCEL_FULL_SCALE)
    assert np.abs(gyr[0, :2]) == pytest.approx(GYRO_FULL_SCALE, rel=1e-4)
    assert np.abs(mag[0, :2]) == pytest.approx(MAG_FULL_SCALE, rel=1e-3)
    r = wearer().samples("hand_r", 0, 100)
    assert np.abs(r.mag / 0.3 - np.round(r.mag / 0.3)).max() < 1e-9
    assert np.abs(r.acc * 4096.0 / G - np.round(r.acc * 4096.0 / G)).max() < 1e-6


def test_an_exact_chip_adds_nothing() -> None:
    chip = Chip.draw(LEVELS["exact"], 1, "hand_r")
    rows = np.random.default_rng(0).normal(size=(3, 50, 3))
    read = chip.read(*rows, 100.0, np.zeros((50, 3)), np.ones((3, 50, 3)))
    assert np.abs(np.array(read) - rows).max() < 1e-12


def put_on(level: str, seed: int, segment: str = "forearm_r") -> tuple[Worn, Person]:
    person = Person(PersonSettings(seed=seed, exercise="reaching"))
    return Worn.put_on(segment, person, LEVELS[level]), person  # type: ignore[arg-type,index]


def test_straps_are_put_on_some_degrees_off_and_settle_after_the_pose() -> None:
    def turn(level: str, seed: int, t: float) -> float:
        worn, person = put_on(level, seed)
        bare = Errors(placement_deg=0.0)
        nominal = Worn.put_on("forearm_r", person, bare)
        if level == "typical":
            worn = replace(worn, placement=nominal.placement, tissue=0.0 * worn.tissue)
        at = np.array([t])
        return float(np.degrees(angle_between(worn.pose(at, person)[0], nominal.pose(at, person)[0]))[0])

    placed = np.array([turn("ideal", seed, 1.0) for seed in range(150)])
    assert np.sqrt((placed**2).mean()) == pytest.approx(10.0, rel=0.15)
    assert max(turn("typical", seed, 3.99) for seed in range(10)) < 1e-4
    settled = np.array([turn("typical", seed, 6.5) for seed in range(150)])
    assert np.sqrt((settled**2).mean()) == pytest.approx(1.5, rel=0.15)


def test_skin_turns_with_its_joints_and_not_in_neutral() -> None:
    worn, person = put_on("typical", 3)
    bone_alone = replace(worn, tissue=0.0 * worn.tissue)
    t = np.arange(0.0, 20.0, 0.1)
    turn = np.degrees(angle_between(worn.pose(t, person)[0], bone_alone.pose(t, person)[0]))
    assert turn[t < 4.0].max() < 1e-4
    assert 1.0 < turn.max() < 6.0


def test_nominal_mounting_puts_z_off_the_skin() -> None:
    w = wearer(segments=EVERYWHERE)
    outward = {"r": [0.0, 0.0, 1.0], "l": [0.0, 0.0, -1.0], "m": [1.0, 0.0, 0.0]}  # segment axes; m: sternum
    for segment in EVERYWHERE:
        mounting = Rotation.from_quat(w.info(segment).mounting, scalar_first=True)  # type: ignore[arg-type]
        assert mounting.apply([0.0, 0.0, 1.0]) == pytest.approx(outward[segment[-1]], abs=1e-12)
        assert mounting.apply([0.0, 1.0, 0.0]) == pytest.approx([0.0, 1.0, 0.0], abs=1e-12)
