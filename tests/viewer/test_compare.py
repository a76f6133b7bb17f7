"""Comparisons whose errors are known, because they were put in; and the real recordings' known figures."""

import os
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from brachium_body import rotation
from brachium_viewer import alignment, compare, compare_text
from brachium_viewer.compare import CompareSettings, Comparison, matched
from brachium_viewer.statistics import orientation_errors_deg
from brachium_wire import table
from brachium_wire.capture import load
from brachium_wire.table import Table, TableError

DATA = Path(os.environ.get("BRACHIUM_DATA", Path(__file__).parents[2].parent / "shared" / "data"))
REAL = pytest.mark.skipif(not DATA.is_dir(), reason=f"no recordings at {DATA}; set BRACHIUM_DATA")
N = 400
TIME = 40.0 + np.arange(N) / 50


def walk(seed: int) -> Any:
    """Return a smooth walk of orientations (N, 4)."""
    steps = np.random.default_rng(seed).normal(scale=0.05, size=(N, 3))
    return (Rotation.from_rotvec(np.cumsum(steps, axis=0))).as_quat(scalar_first=True)


def columns(stem: str, q: Any) -> dict[str, Any]:
    return {f"{stem}_q{part}": q[:, i] for i, part in enumerate("wxyz")}


def compare_tables(a: Table, b: Table, chosen: CompareSettings) -> Comparison:
    return matched(a, b, chosen)[0]


@pytest.mark.parametrize("lag", [float("nan"), float("inf"), float("-inf")])
def test_a_lag_that_is_no_number_is_refused(lag: float) -> None:
    same = Table({"time": TIME, "elbow_flexion": TIME}, {"elbow_flexion": "deg"})
    with pytest.raises(TableError, match=r"lag = -?(nan|inf): expected seconds"):
        compare_tables(same, same, CompareSettings(lag=lag))


@pytest.mark.parametrize(("error", "shown"), [(5e-10, "0"), (-5e-10, "0"), (2e-9, "2e-09")])
def test_angles_of_rounding_size_are_shown_as_0(error: float, shown: str) -> None:
    b = Table({"time": TIME, "elbow_flexion": 0.0 * TIME}, {"elbow_flexion": "deg"})
    a = Table({"time": TIME, "elbow_flexion": 0.0 * TIME + error}, {"elbow_flexion": "deg"})
    found = compare_tables(a, b, CompareSettings())
    assert found.columns["elbow_flexion"].bias == pytest.approx(error)  # the figure itself stays
    lines = compare_text.text(found).splitlines()
    line = lines[lines.index("", 1) + 2].removeprefix("elbow_flexion, deg").split()
    assert line == [shown, shown, "0", shown, str(N)]


def test_columns_give_bias_spread_and_largest() -> None:
    swing = np.where(np.arange(N) % 2, 1.0, -1.0)
    b = Table({"time": TIME, "elbow_flexion": 170.0 * np.sin(TIME), "only_b": TIME}, {"elbow_flexion": "deg"})
    a = Table(
        {"time": TIME, "elbow_flexion": b.columns["elbow_flexion"] + 3.0 + swing + 360.0, "only_a": TIME}
    )
    found = compare_tables(a, b, CompareSettings())
    assert list(found.columns) == ["elbow_flexion"]
    error = found.columns["elbow_flexion"]
    assert (error.n, found.rows, found.lag_s) == (N, N, 0.0)
    assert error.bias == pytest.approx(3.0, abs=1e-9)
    assert error.rmse == pytest.approx(np.sqrt(10.0), abs=1e-9)
    assert error.max_abs == pytest.approx(4.0, abs=1e-9)


@given(seed=st.integers(0, 1000), angle=st.floats(0.01, 3.0), axis=st.integers(0, 2))
@settings(max_examples=25, deadline=None)
def test_a_constant_turn_of_the_world_is_found_whole(seed: int, angle: float, axis: int) -> None:
    q = walk(seed)
    turned = rotation.multiply(rotation.about(axis, angle), q)
    a = Table({"time": TIME, **columns("hand_r", -turned)})  # either sign is the same orientation
    found = compare_tables(a, Table({"t": TIME, **columns("hand_r", q)}), CompareSettings()).orientations[
        "hand_r"
    ]
    assert found.total.rmse == pytest.approx(np.degrees(angle), abs=1e-6)
    heading, inclination = (angle, 0.0) if axis == 2 else (0.0, angle)
    assert found.heading.rmse == pytest.approx(np.degrees(heading), abs=1e-6)
    assert found.heading.bias == pytest.approx(np.degrees(heading), abs=1e-6)
    assert found.inclination.rmse == pytest.approx(np.degrees(inclination), abs=1e-6)


@given(seed=st.integers(0, 2**32 - 1))
def test_the_whole_angle_agrees_with_scipy_and_holds_its_parts(seed: int) -> None:
    random = np.random.default_rng(seed)
    p, q = (Rotation.from_rotvec(random.normal(size=(20, 3))) for _ in range(2))
    total, heading, inclination = orientation_errors_deg(
        p.as_quat(scalar_first=True), q.as_quat(scalar_first=True)
    )
    np.testing.assert_allclose(total, np.degrees((p * q.inv()).magnitude()), atol=1e-9)
    together = np.cos(np.radians(heading) / 2) * np.cos(np.radians(inclination) / 2)
    np.testing.assert_allclose(np.abs(together), np.cos(np.radians(total) / 2), atol=1e-9)


def test_a_turn_of_both_is_no_error_between_them() -> None:
    upper, fore = walk(1), walk(2)
    turn = rotation.about(2, 0.7)
    b = Table({"t": TIME, **columns("upper_arm_r_sensor", upper), **columns("forearm_r_sensor", fore)})
    both = {
        "upper_arm_r_sensor": rotation.multiply(turn, upper),
        "forearm_r_sensor": rotation.multiply(turn, rotation.multiply(fore, rotation.about(0, 0.1))),
    }
    a = Table({"time": TIME, **{n: c for stem, q in both.items() for n, c in columns(stem, q).items()}})
    found = compare_tables(a, b, CompareSettings())
    assert list(found.relative) == ["forearm_r_sensor from upper_arm_r_sensor"]
    assert found.relative["forearm_r_sensor from upper_arm_r_sensor"].rmse == pytest.approx(
        np.degrees(0.1), abs=1e-6
    )
    assert found.orientations["upper_arm_r_sensor"].total.rmse == pytest.approx(np.degrees(0.7), abs=1e-6)


def test_neighbours_are_of_one_arm_and_one_kind() -> None:
    stems = [
        "sternum",
        "upper_arm_r",
        "hand_r",
        "upper_arm_l",
        "forearm_l",
        "upper_arm_r_sensor",
        "hand_r_sensor",
    ]
    assert alignment.neighbours(stems) == [
        ("sternum", "upper_arm_r"),
        ("upper_arm_r", "hand_r"),
        ("sternum", "upper_arm_l"),
        ("upper_arm_l", "forearm_l"),
        ("upper_arm_r_sensor", "hand_r_sensor"),
    ]


@pytest.mark.parametrize("shift", [-2, -1, 0, 1, 2])
def test_the_lag_is_found(shift: int) -> None:
    q = walk(3)
    b = Table({"t": TIME, **columns("hand_r", q)})
    a = Table({"time": TIME + shift / 50, **columns("hand_r", q)})
    found = compare_tables(a, b, CompareSettings(lag="estimate"))
    assert found.lag_s == pytest.approx(shift / 50)
    assert found.orientations["hand_r"].total.rmse < 1e-6
    assert found.orientations["hand_r"].total.n == N
    exact = compare_tables(a, b, CompareSettings(lag=shift / 50))
    assert exact.orientations == found.orientations
    if shift:
        assert compare_tables(a, b, CompareSettings()).orientations["hand_r"].total.rmse > 1.0


def test_only_rows_that_count_are_counted() -> None:
    moving = np.arange(N) % 4 == 0
    wrong = np.where(moving, 1.0, 50.0)
    b = Table({"t": TIME, "x": np.zeros(N), "movement": moving})
    found = compare_tables(Table({"t": TIME, "x": wrong}), b, CompareSettings(mask="movement"))
    assert found.columns["x"].max_abs == 1.0
    assert found.rows == found.columns["x"].n == N // 4
    later = compare_tables(
        Table({"t": TIME, "x": wrong}), b, CompareSettings(mask="movement", from_s=42.0, to_s=44.0)
    )
    assert later.rows == int((moving & (TIME >= 42.0) & (TIME <= 44.0)).sum())


def test_other_rates_meet_by_interpolation_and_gaps_stay_gaps() -> None:
    fine = np.arange(0, 8, 0.003)
    fine = fine[(fine < 3.0) | (fine > 4.0)]
    a = Table({"time": 40.0 + fine, "x": fine * 2.0})
    b = Table({"t": TIME, "x": (TIME - 40.0) * 2.0})
    found = compare_tables(a, b, CompareSettings()).columns["x"]
    assert found.max_abs < 1e-9
    inside = int((((TIME - 40.0) < 2.999) | ((TIME - 40.0) > 4.0)).sum())
    assert abs(found.n - inside) <= 2


def test_an_orientation_known_beside_an_unknown_one_counts() -> None:
    q = walk(4)
    holes = q.copy()
    holes[10:20] = np.nan
    found = compare_tables(
        Table({"t": TIME, **columns("hand_r", holes)}),
        Table({"t": TIME, **columns("hand_r", q)}),
        CompareSettings(),
    )
    assert found.orientations["hand_r"].total.n == N - 10
    assert found.orientations["hand_r"].total.max_abs < 1e-6


@given(seed=st.integers(0, 10_000))
@settings(max_examples=25, deadline=None)
def test_orientations_between_two_agree_with_scipy(seed: int) -> None:
    from scipy.spatial.transform import Slerp

    random = np.random.default_rng(seed)
    at = np.cumsum(random.uniform(0.01, 0.09, 20))
    q = Rotation.from_rotvec(random.normal(size=(20, 3)))
    time = random.uniform(at[0], at[-1], 50)
    got = alignment.orientations_at(time, at, q.as_quat(scalar_first=True))
    judged = Slerp(at, q)(time)
    error = Rotation.from_quat(got, scalar_first=True) * judged.inv()
    assert error.magnitude().max() < 1e-6


@pytest.mark.parametrize(
    ("a", "b", "said"),
    [
        ({"x": [1.0, 2.0]}, {"t": [0.0, 1.0], "x": [1.0, 2.0]}, "column time or t"),
        ({"t": [1.0, 1.0], "x": [1.0, 2.0]}, {"t": [0.0, 1.0], "x": [1.0, 2.0]}, "must grow"),
        ({"t": [0.0, 1.0], "x": [1.0, 2.0]}, {"t": [0.0, 1.0], "y": [1.0, 2.0]}, "no column in common"),
        ({"t": [0.0, 0.1], "x": [1.0, 2.0]}, {"t": [5.0, 5.1], "x": [1.0, 2.0]}, "share no instant"),
    ],
)
def test_what_cannot_be_compared_is_named(a: Any, b: Any, said: str) -> None:
    first, second = (Table({n: np.array(v) for n, v in side.items()}) for side in (a, b))
    with pytest.raises(TableError, match=said):
        compare_tables(first, second, CompareSettings())


def test_other_units_are_refused_not_misread() -> None:
    a = Table({"t": TIME, "x": TIME}, {"x": "rad"})
    with pytest.raises(TableError, match="column x: a is in rad, b in deg"):
        compare_tables(a, Table({"t": TIME, "x": TIME}, {"x": "deg"}), CompareSettings())
    with pytest.raises(TableError, match="no column 'moves'"):
        compare_tables(a, a, CompareSettings(mask="moves"))


@pytest.mark.parametrize("ending", ["csv", "parquet"])
def test_files_and_the_settings_beside_a_truth(tmp_path: Path, ending: Literal["csv", "parquet"]) -> None:
    q = walk(5)
    table.write(
        tmp_path / f"a.{ending}", {"time": TIME + 0.02, **columns("hand_r_sensor", q)}, {"time": "s"}, {}
    )
    truth = {"t": TIME, **columns("hand_r_sensor", q), "movement": np.arange(N) > 100}
    table.write(tmp_path / "truth.parquet", truth, {}, {})
    (tmp_path / "capture.toml").write_text(
        '[truth]\nmetric = "relative"\nmask = "movement"\nmax_lag_samples = 2\n'
    )
    found, _ = compare.compare(tmp_path / f"a.{ending}", tmp_path / "truth.parquet")
    assert found.lag_s == pytest.approx(0.02)
    assert found.mask == "movement"
    assert found.rows == N - 101
    assert found.orientations["hand_r_sensor"].total.rmse < 1e-6
    assert found.to_json()["orientations"]["hand_r_sensor"]["total"]["n"] == N - 101
    said = compare_text.text(found)
    assert "lag 20.0 ms taken out" in said
    assert "hand_r_sensor, whole angle, deg" in said


@pytest.mark.data
@REAL
@pytest.mark.parametrize(
    ("name", "published"),
    [
        ("broad_02_undisturbed_slow_rotation_B", 1.38),
        ("broad_16_undisturbed_fast_translation_B", 0.74),
        ("broad_25_disturbed_tapping_B", 1.62),
        ("broad_30_disturbed_stationary_magnet_C", 2.57),
    ],
)
def test_the_authors_metric_gives_the_filters_known_figure(
    tmp_path: Path, name: str, published: float
) -> None:
    """VQF 9D as it is, online: the figure was measured with another program."""
    from vqf import VQF

    segment = load(DATA / name).segments["forearm_r"]
    assert segment.acc is not None
    assert segment.gyr is not None
    assert segment.mag is not None
    out = VQF(1.0 / segment.rate_hz).updateBatch(
        *(np.ascontiguousarray(block) for block in (segment.gyr, segment.acc, segment.mag))
    )
    table.write(
        tmp_path / "a.parquet", {"time": segment.t, **columns("forearm_r_sensor", out["quat9D"])}, {}, {}
    )
    found, _ = compare.compare(tmp_path / "a.parquet", DATA / name / "truth.parquet")
    assert found.mask == "movement"
    print(name, found.orientations["forearm_r_sensor"].total)
    assert found.orientations["forearm_r_sensor"].total.rmse == pytest.approx(published, abs=0.02)


@pytest.mark.data
@REAL
@pytest.mark.parametrize(
    ("name", "published"), [("twoseg_1D_02", 1.5), ("twoseg_1D_03", 2.0), ("twoseg_2D_01", 1.6)]
)
def test_relative_orientations_give_the_filters_known_figure(
    tmp_path: Path, name: str, published: float
) -> None:
    """VQF 6D alone, where the two sensors' headings happen to begin together."""
    from vqf import VQF

    made: dict[str, Any] = {}
    for segment, data in load(DATA / name).segments.items():
        assert data.acc is not None
        assert data.gyr is not None
        blocks = (np.ascontiguousarray(block) for block in (data.gyr, data.acc))
        made |= {
            "time": data.t,
            **columns(f"{segment}_sensor", VQF(1.0 / data.rate_hz).updateBatch(*blocks)["quat6D"]),
        }
    table.write(tmp_path / "a.parquet", made, {}, {})
    found, _ = compare.compare(tmp_path / "a.parquet", DATA / name / "truth.parquet")
    error = found.relative["forearm_r_sensor from upper_arm_r_sensor"]
    print(name, found.lag_s, error)
    assert error.rmse == pytest.approx(published, abs=0.1)
