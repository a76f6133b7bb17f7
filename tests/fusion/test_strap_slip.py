"""Strap slips: found where one was emulated, on the right sensor, and nowhere else; told in words."""

from dataclasses import replace

import numpy as np
import pytest

from brachium_body import rotation
from brachium_body.segments import Segment
from brachium_fusion.live_arm import SensorNow
from brachium_fusion.slip_postures import turned_since
from brachium_fusion.strap_slip import Slip, SlipWatch
from brachium_fusion.timeline import Motion
from brachium_nodes.sensors import LEVELS, Level
from brachium_nodes.session import SessionArrays, session_arrays
from brachium_nodes.wearer import WearerSettings
from brachium_nodes.wearing import Wearing

RATE_HZ = 25.0
SLIP_S = 20.0
UPPER: Segment = "upper_arm_r"
FOREARM: Segment = "forearm_r"
HAND: Segment = "hand_r"


def _session(exercise: str, slip: Segment | None, level: Level = "typical", seed: int = 4) -> SessionArrays:
    errors = replace(LEVELS[level], slip_deg=8.0 if slip else 0.0)
    wearing = Wearing(slip_segment=slip, slip_s=SLIP_S)
    settings = WearerSettings(
        exercise=exercise, level=level, errors=errors, wearing=wearing, seed=seed, rate_hz=RATE_HZ
    )
    return session_arrays(settings, 55.0)


def _instants(session: SessionArrays) -> list[tuple[int, dict[str, SensorNow]]]:
    return [
        (
            round(t * 1e9),
            {
                s: SensorNow(x.world_from_sensor[k], Motion(x.gyr[k], x.acc[k]))
                for s, x in session.sensors.items()
            },
        )
        for k, t in enumerate(session.time_s.tolist())
    ]


def _watched(session: SessionArrays) -> list[Slip]:
    watch = SlipWatch((UPPER, FOREARM, HAND))
    slips = [watch.step(now, sensors) for now, sensors in _instants(session)]
    return [slip for slip in slips if slip is not None]


@pytest.mark.parametrize(
    ("exercise", "segment", "level"),
    [
        ("reaching", UPPER, "typical"),
        ("drinking", FOREARM, "patient"),
        ("shrugging", HAND, "typical"),
    ],
)
def test_an_emulated_slip_is_found_on_the_sensor_that_slipped(
    exercise: str, segment: Segment, level: Level
) -> None:
    """One slip is told, of its segment, between the rests around it, and not larger than it is."""
    (slip,) = _watched(_session(exercise, segment, level))
    assert slip.segment == segment
    assert slip.after_ns <= (SLIP_S + 0.3) * 1e9
    assert SLIP_S * 1e9 - 2e9 <= slip.time_ns < slip.found_ns
    assert 4.0 <= slip.size_deg <= 9.5
    assert segment.split("_")[0] in slip.text
    assert "tighten its strap" in slip.text


@pytest.mark.parametrize("exercise", ["reaching", "free", "wrist-flexion"])
def test_straps_that_hold_are_left_in_peace(exercise: str) -> None:
    """Movement, settling skin, tremor and pauses anywhere are no slip."""
    assert _watched(_session(exercise, None, "patient")) == []


def test_a_watch_goes_on_from_its_state() -> None:
    """Stopped anywhere and restored, it says the same at the same instant."""
    instants = _instants(_session("reaching", FOREARM))
    whole = SlipWatch((UPPER, FOREARM, HAND))
    said = [whole.step(now, sensors) for now, sensors in instants]
    cut = len(instants) // 3
    first, second = SlipWatch((UPPER, FOREARM, HAND)), SlipWatch((UPPER, FOREARM, HAND))
    pieces = [first.step(now, sensors) for now, sensors in instants[:cut]]
    second.restore(first.state())
    pieces += [second.step(now, sensors) for now, sensors in instants[cut:]]
    assert pieces == said
    assert any(said)


def test_a_watch_that_forgets_compares_with_nothing_before() -> None:
    """After a new pose the sensor as it sits now is right."""
    watch, said = SlipWatch((UPPER, FOREARM, HAND)), []
    for now, sensors in _instants(_session("reaching", FOREARM)):
        if now == SLIP_S * 1e9 + 1e9:
            watch.forget()
        said.append(watch.step(now, sensors))
    assert not any(said)


def test_one_sensor_alone_tells_nothing() -> None:
    """Without a neighbour no posture can be told again."""
    watch = SlipWatch((FOREARM,))
    assert not any(watch.step(now, sensors) for now, sensors in _instants(_session("reaching", FOREARM)))


def _rests(turn: np.ndarray | None, sensors: int = 3) -> np.ndarray:
    """Return twelve rests in three postures in turn; from the seventh on, sensor 1 sits turned."""
    random = np.random.default_rng(5)
    postures = random.standard_normal((3, sensors, 3))
    ups = np.tile(postures / np.linalg.norm(postures, axis=2, keepdims=True), (4, 1, 1))
    ups = ups + 0.002 * random.standard_normal(ups.shape)
    if turn is not None:
        ups[6:, 1] = rotation.rotate(rotation.inverse(rotation.from_rotation_vector(turn)), ups[6:, 1])
    return np.asarray(ups / np.linalg.norm(ups, axis=2, keepdims=True))


def test_several_postures_tell_the_whole_turn() -> None:
    """Gravity seen from three sides leaves nothing of a turn unknown."""
    turn = np.radians([3.0, -5.0, 6.0])
    found = turned_since(_rests(turn))
    assert found is not None
    assert (found.sensor, found.split) == (1, 6)
    np.testing.assert_allclose(found.turn, turn, atol=np.radians(0.4))


def test_without_a_turn_there_is_no_evidence() -> None:
    """Nothing looks strange; and a posture never met before is no turn."""
    assert turned_since(_rests(None)) is None
    ups = _rests(None)
    ups[6:] = np.roll(ups[6:], 1, axis=2)
    found = turned_since(ups)
    assert found is None or found.evidence < 1.0


def test_a_turn_about_the_vertical_is_not_seen() -> None:
    """With one posture only: gravity does not change with it."""
    ups = np.tile(_rests(None)[:1], (12, 1, 1))
    turned = rotation.from_rotation_vector(np.radians(8.0) * ups[0, 1])
    ups[6:, 1] = rotation.rotate(turned, ups[6:, 1])
    assert turned_since(ups) is None
