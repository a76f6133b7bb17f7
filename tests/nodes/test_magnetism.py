"""The disturbed field: size and pace as stated, each sensor its own, and a magnet that is passed."""

from dataclasses import replace

import numpy as np
import pytest

from brachium_body.rotation import rotate
from brachium_nodes.magnetism import CORRELATION_S, Magnet, Surroundings, dipole_ut, wandering
from brachium_nodes.movement import Variation
from brachium_nodes.sensors import FIELD_UT, LEVELS
from brachium_nodes.session import SessionArrays, session_arrays
from brachium_nodes.wearer import WearerSettings


def field(s: SessionArrays, segment: str) -> np.ndarray:
    sensor = s.sensors[segment]  # type: ignore[index]
    return rotate(sensor.world_from_sensor, sensor.mag)


def session(surroundings: Surroundings, seconds: float, **other: object) -> SessionArrays:
    made = {"errors": LEVELS["exact"], "rate_hz": 25.0, "surroundings": surroundings, **other}
    return session_arrays(WearerSettings(**made), seconds)  # type: ignore[arg-type]


def test_the_wandering_field_has_its_size_and_its_correlation() -> None:
    t = np.arange(0.0, 2000.0, 0.1)
    w = np.stack([wandering(t, Variation(seed, "hand_r")) for seed in range(10)])
    assert np.sqrt((w**2).mean(axis=(0, 1))) == pytest.approx(np.ones(3), rel=0.05)
    for seconds in (0.5 * CORRELATION_S, CORRELATION_S, 2.0 * CORRELATION_S):
        lag = round(10 * seconds)
        measured = (w[:, lag:] * w[:, :-lag]).mean()
        assert measured == pytest.approx(np.exp(-0.5 * (seconds / CORRELATION_S) ** 2), abs=0.08)


def test_sensors_are_disturbed_each_in_its_own_way() -> None:
    s = session(Surroundings(disturbance_ut=8.0), 120.0)
    off = {name: field(s, name) - FIELD_UT for name in s.sensors}
    for name in s.sensors:
        assert np.sqrt((off[name] ** 2).mean()) == pytest.approx(8.0, rel=0.25)
    pair = np.corrcoef(off["forearm_r"].ravel(), off["hand_r"].ravel())[0, 1]
    assert abs(pair) < 0.3


def test_a_dipole_is_the_sum_of_two_poles() -> None:
    away, moment, half = np.array([[0.3, -0.2, 0.15], [0.0, 0.0, 0.2]]), np.array([0.4, 0.1, -0.8]), 1e-4
    size = np.linalg.norm(moment)

    def pole(place: np.ndarray) -> np.ndarray:
        r = away - place
        return 0.1 * size / (2.0 * half) * r / np.linalg.norm(r, axis=1, keepdims=True) ** 3

    way = half * moment / size
    assert dipole_ut(away, moment) == pytest.approx(pole(way) - pole(-way), rel=1e-5)


def test_a_magnet_is_seen_while_the_hand_is_near_it() -> None:
    undisturbed = session(Surroundings(), 30.0, exercise="reaching")
    hand = undisturbed.arms["right"].world_positions["hand"]
    near = Magnet(place_m=tuple((hand[np.argmax(hand[:, 1])] + [0.0, 0.03, -0.1]).tolist()))  # type: ignore[arg-type]
    s = session(Surroundings(magnet=near), 30.0, exercise="reaching")
    off = np.linalg.norm(field(s, "hand_r") - FIELD_UT, axis=1)
    away = np.linalg.norm(hand - near.place_m, axis=1)
    assert off[away < 0.15].min() > 5.0
    assert off[away > 0.5].max() < 3.0
    assert np.abs(s.sensors["hand_r"].acc - undisturbed.sensors["hand_r"].acc).max() < 1e-12


def test_an_undisturbed_field_is_the_earths() -> None:
    assert np.abs(field(session(Surroundings(), 10.0), "hand_r") - FIELD_UT).max() < 1e-9


def test_what_is_no_disturbance_is_refused() -> None:
    with pytest.raises(ValueError, match="-3"):
        replace(Surroundings(), disturbance_ut=-3.0)
