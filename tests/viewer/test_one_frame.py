"""Turns and shifts that were put in are found and taken out."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from brachium_body import rotation
from brachium_viewer.one_frame import in_one_frame

N = 60
ALL = np.ones(N, dtype=np.bool_)


def made(seed: int) -> tuple[Any, Any, Any]:
    random = np.random.default_rng(seed)
    q = Rotation.from_rotvec(random.normal(size=(N, 3))).as_quat(scalar_first=True)
    return random, q, random.normal(size=(N, 3))


def numbers(stem: str, a: Any, b: Any) -> dict[str, Any]:
    return {f"{stem}_{axis}": (a[:, k], b[:, k]) for k, axis in enumerate("xyz")}


@given(st.integers(0, 10_000))
def test_a_rigid_turn_and_shift_is_taken_out_whole(seed: int) -> None:
    random, q, points = made(seed)
    turn = rotation.normalize(random.normal(size=4))
    shift = random.normal(size=3)
    moved = rotation.rotate(turn, points) + shift
    orientations, found, removed = in_one_frame(
        {"hand_r": (rotation.multiply(turn, q), q)},
        {**numbers("wrist", moved, points), "elbow_flexion": (points[:, 0], points[:, 1])},
        ALL,
        "rigid",
    )
    a, b = orientations["hand_r"]
    assert rotation.angle_between(a, b).max() < 1e-6
    for axis in "xyz":
        a, b = found[f"wrist_{axis}"]
        np.testing.assert_allclose(a, b, atol=1e-9)
    np.testing.assert_array_equal(found["elbow_flexion"][0], points[:, 0])  # angles are of no frame
    angle = np.degrees(rotation.angle_between(rotation.IDENTITY, turn))
    assert removed is not None
    assert removed.turn_deg == pytest.approx(angle, abs=1e-5)
    assert removed.positions_turn_deg == pytest.approx(angle, abs=1e-5)


@given(st.integers(0, 10_000))
def test_a_heading_takes_out_no_tilt(seed: int) -> None:
    random, q, points = made(seed)
    yaw, tilt = random.uniform(-3.0, 3.0), 0.2
    turn = rotation.multiply(rotation.about(2, yaw), rotation.about(0, tilt))
    orientations, found, _ = in_one_frame(
        {"hand_r": (rotation.multiply(turn, q), q)},
        numbers("wrist", rotation.rotate(rotation.about(2, yaw), points), points),
        ALL,
        "heading",
    )
    left = rotation.angle_between(*orientations["hand_r"])
    assert left == pytest.approx(np.full(N, tilt), abs=1e-6)
    for axis in "xyz":
        np.testing.assert_allclose(*found[f"wrist_{axis}"], atol=1e-9)


def test_displacements_turn_and_do_not_shift() -> None:
    _, _, points = made(1)
    turn = rotation.about(2, 0.5)
    moved = rotation.rotate(turn, points)
    _, found, _ = in_one_frame(
        {},
        {
            **numbers("wrist", moved + np.array([1.0, 2.0, 3.0]), points),
            **numbers("shoulder_shift", 0.1 * moved, 0.1 * points),
        },
        ALL,
        "rigid",
    )
    for axis in "xyz":
        np.testing.assert_allclose(*found[f"shoulder_shift_{axis}"], atol=1e-9)


def test_rows_that_do_not_count_do_not_decide() -> None:
    _, q, _ = made(2)
    turned = q.copy()
    turned[:20] = rotation.multiply(rotation.about(1, 1.0), q[:20])
    orientations, _, removed = in_one_frame({"hand_r": (turned, q)}, {}, np.arange(N) >= 20, "rigid")
    assert removed is not None
    assert removed.turn_deg == pytest.approx(0.0, abs=1e-6)
    assert rotation.angle_between(*orientations["hand_r"])[:20] == pytest.approx(np.ones(20))


def test_none_changes_nothing() -> None:
    _, q, points = made(3)
    orientations, found, removed = in_one_frame(
        {"hand_r": (q, q)}, numbers("wrist", points, points), ALL, "none"
    )
    assert removed is None
    np.testing.assert_array_equal(orientations["hand_r"][0], q)
    assert set(found) == {"wrist_x", "wrist_y", "wrist_z"}
