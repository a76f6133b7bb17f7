"""Strap slips: found where one was emulated, on the right sensor, and nowhere else; told in words."""

from dataclasses import replace

import numpy as np
import pytest

from brachium_body import rotation
from brachium_body.segments import Segment
from brachium_fusion.joint_model import Joint
from brachium_fusion.strap_slip import Slip, SlipWatch
from brachium_fusion.timeline import Motion, SensorNow
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


def _watch(session: SessionArrays) -> SlipWatch:
    """Return a watch that knows the joints' axes from how the sensors sat in the pose."""
    from_segment = {s: rotation.inverse(x.segment_from_sensor[0]) for s, x in session.sensors.items()}
    x, y, z = np.eye(3)
    joints = [
        Joint(
            axes=2,
            axis_a=rotation.rotate(from_segment[upper], z),
            axis_b=rotation.rotate(from_segment[lower], axis),
            lever_a=None,
            lever_b=None,
        )
        for upper, lower, axis in ((UPPER, FOREARM, y), (FOREARM, HAND, x))
    ]
    return SlipWatch((UPPER, FOREARM, HAND), RATE_HZ, joints)


def _watched(session: SessionArrays) -> list[Slip]:
    watch = _watch(session)
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


def test_movement_in_which_no_posture_comes_back_tells_by_the_joints() -> None:
    """Without the joints nothing is said: each pause of free movement is another posture."""
    session = _session("free", FOREARM)
    (slip,) = _watched(session)
    assert slip.segment == FOREARM
    assert abs(slip.time_ns - SLIP_S * 1e9) <= 5e9
    bare = SlipWatch((UPPER, FOREARM, HAND))
    assert not any(bare.step(now, sensors) for now, sensors in _instants(session))


def test_a_watch_goes_on_from_its_state() -> None:
    """Stopped anywhere and restored, it says the same at the same instant."""
    session = _session("reaching", FOREARM)
    instants, whole = _instants(session), _watch(session)
    said = [whole.step(now, sensors) for now, sensors in instants]
    cut = len(instants) // 3
    first, second = _watch(session), _watch(session)
    pieces = [first.step(now, sensors) for now, sensors in instants[:cut]]
    second.restore(first.state())
    pieces += [second.step(now, sensors) for now, sensors in instants[cut:]]
    assert pieces == said
    assert any(said)


def test_a_watch_that_forgets_compares_with_nothing_before() -> None:
    """After a new pose the sensor as it sits now is right."""
    session = _session("reaching", FOREARM)
    watch, said = _watch(session), []
    for now, sensors in _instants(session):
        if now == SLIP_S * 1e9 + 1e9:
            watch.forget()
        said.append(watch.step(now, sensors))
    assert not any(said)


def test_one_sensor_alone_tells_nothing() -> None:
    """Without a neighbour no posture can be told again."""
    watch = SlipWatch((FOREARM,))
    assert not any(watch.step(now, sensors) for now, sensors in _instants(_session("reaching", FOREARM)))
