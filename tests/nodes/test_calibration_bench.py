"""A chip on the bench: its raw readings give the calibration that was put into it."""

import numpy as np
import pytest
from scipy.optimize import least_squares

from brachium_nodes.calibration_bench import FACES, BenchReadings, CalibrationBench
from brachium_nodes.sensors import FIELD_UT, LEVELS, G
from brachium_nodes.session import session_arrays
from brachium_nodes.wearer import WearerSettings


def bench(seed: int = 3, level: str = "ideal", rate_hz: float = 50.0) -> CalibrationBench:
    return CalibrationBench(WearerSettings(seed=seed, level=level, rate_hz=rate_hz), "forearm_r")  # type: ignore[arg-type]


def three(v: object) -> np.ndarray:
    return np.array(v, dtype=float)


@pytest.mark.parametrize("seed", range(4))
def test_the_rest_tells_the_gyros_bias(seed: int) -> None:
    one = bench(seed)
    rest = one.at_rest(8.0)
    assert len(rest.gyr) == 400
    off = np.degrees(rest.gyr.mean(axis=0) - three(one.perfect_calibration().gyro_bias))
    assert np.abs(off).max() < 0.02
    assert np.linalg.norm(np.degrees(rest.gyr.mean(axis=0))) > 0.5


def test_the_faces_point_where_they_say() -> None:
    one = bench()
    faces, c = one.six_faces(), one.perfect_calibration()
    assert tuple(faces) == FACES
    for face, readings in faces.items():
        up = (three(c.accel_scale) * (readings.acc - three(c.accel_bias))).mean(axis=0)
        axis = "xyz".index(face[1])
        sign = 1.0 if face[0] == "+" else -1.0
        assert np.linalg.norm(up) == pytest.approx(G, rel=1e-3)
        tilt = np.degrees(np.arccos(np.clip(sign * up[axis] / np.linalg.norm(up), -1.0, 1.0)))
        assert 0.0 < tilt < 4.0


def test_sixteen_poses_spread_over_the_sphere_give_scale_and_bias() -> None:
    one = bench()
    poses = one.still_poses()
    means = np.stack([p.acc.mean(axis=0) for p in poses])
    unit = means / np.linalg.norm(means, axis=1, keepdims=True)
    assert len(poses) == 16
    assert np.linalg.svd(unit)[1].min() > 2.0

    def off(p: np.ndarray) -> np.ndarray:
        return np.linalg.norm(p[:3] * (means - p[3:]), axis=1) - G

    found = least_squares(off, [1.0, 1.0, 1.0, 0.0, 0.0, 0.0]).x
    c = one.perfect_calibration()
    assert found[:3] == pytest.approx(three(c.accel_scale), abs=5e-4)
    assert found[3:] == pytest.approx(three(c.accel_bias), abs=0.01)


def test_turning_shows_the_magnetometer_the_whole_sphere() -> None:
    one = bench()
    turns, c = one.turned_everywhere(), one.perfect_calibration()
    field = (turns.mag - three(c.mag_offset)) @ three(c.mag_matrix).T
    size = np.linalg.norm(field, axis=1)
    assert size.mean() == pytest.approx(np.linalg.norm(FIELD_UT), abs=0.1)
    assert size.std() < 0.6
    octants = {tuple(row) for row in (field > 0.0).tolist()}
    assert len(octants) == 8
    assert np.ptp(np.linalg.norm(turns.mag, axis=1)) > 20.0


def test_on_an_exact_chip_turning_and_rate_agree() -> None:
    turns = bench(level="exact", rate_hz=200.0).turned_everywhere(10.0)
    rate = np.cross(turns.gyr, turns.acc)
    change = np.gradient(turns.acc, 1.0 / 200.0, axis=0)
    assert np.abs(change + rate)[2:-2].max() < 0.02 * np.abs(rate).max()


def test_the_chip_is_the_wearers() -> None:
    one = bench()
    worn = session_arrays(one.settings, 3.0, raw=True).sensors["forearm_r"]
    c = one.perfect_calibration()
    assert np.linalg.norm((worn.gyr - three(c.gyro_bias)).mean(axis=0)) < np.radians(0.02)
    assert np.linalg.norm(three(c.accel_scale) * (worn.acc - three(c.accel_bias)), axis=1).mean() == (
        pytest.approx(G, abs=0.01)
    )
    assert worn.calibration == one.chip.calibration


def test_readings_come_from_the_seed_and_differ_by_what_is_done() -> None:
    def acc(of: BenchReadings) -> np.ndarray:
        return of.acc

    assert np.array_equal(acc(bench(1).at_rest()), acc(bench(1).at_rest()))
    assert not np.array_equal(acc(bench(1).at_rest()), acc(bench(2).at_rest()))
    faces = bench(1).six_faces()
    assert np.abs(faces["+z"].gyr - bench(1).at_rest(2.0).gyr).max() > 0.0


def test_without_errors_everything_is_exact() -> None:
    one = bench(level="exact")
    assert one.at_rest().acc == pytest.approx(np.tile([0.0, 0.0, G], (250, 1)), abs=1e-9)
    assert one.perfect_calibration().accel_scale == pytest.approx((1.0, 1.0, 1.0))
    assert LEVELS["exact"].gyro_bias_raw == 0.0
