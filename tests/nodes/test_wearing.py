"""How sensors are worn: elsewhere than they should be, turned, slipped, or on skin that lags behind."""

from dataclasses import replace

import numpy as np
import pytest

from brachium_body.lengths import from_height
from brachium_body.rotation import angle_between, inverse, multiply, rotate, to_rotation_vector
from brachium_nodes.places import ARRANGEMENTS, place
from brachium_nodes.sensors import LEVELS, Errors, G
from brachium_nodes.session import SessionArrays, session_arrays
from brachium_nodes.wearer import Wearer, WearerSettings
from brachium_nodes.wearing import TURNS, Wearing

EXACT = LEVELS["exact"]


def session(wearing: Wearing, seconds: float = 3.0, errors: Errors = EXACT, **other: object) -> SessionArrays:
    made = {"rate_hz": 50.0, "seed": 2, "errors": errors, "wearing": wearing, **other}
    return session_arrays(WearerSettings(**made), seconds)  # type: ignore[arg-type]


def test_swapped_nodes_read_what_the_other_place_does_and_are_told_so() -> None:
    plain = session(Wearing(), 12.0)
    swapped = session(Wearing(seats={"upper_arm_r": "forearm_r", "forearm_r": "upper_arm_r"}), 12.0)
    assert np.abs(swapped.sensors["upper_arm_r"].gyr - plain.sensors["forearm_r"].gyr).max() < 1e-9
    assert np.abs(swapped.sensors["forearm_r"].acc - plain.sensors["upper_arm_r"].acc).max() < 1e-9
    really = swapped.sensors["upper_arm_r"].world_from_sensor
    assert angle_between(really, plain.sensors["forearm_r"].world_from_sensor).max() < 1e-7
    assert set(swapped.sensors["upper_arm_r"].levers) == {"elbow", "wrist"}


def test_nodes_of_the_right_arm_on_the_left_keep_their_nominal_mounting() -> None:
    names = ("upper_arm", "forearm", "hand")
    seats = {f"{name}_r": f"{name}_l" for name in names}
    wrong = session(Wearing(seats=seats), 12.0, arms="left", segments=tuple(seats))  # type: ignore[arg-type]
    right = session(Wearing(), 12.0, arms="left")
    for name in names:
        mine, theirs = wrong.sensors[f"{name}_r"], right.sensors[f"{name}_l"]  # type: ignore[index]
        assert np.abs(mine.gyr - theirs.gyr).max() < 1e-9
        assert np.degrees(angle_between(mine.nominal_mounting, theirs.nominal_mounting)) == pytest.approx(180)


@pytest.mark.parametrize(
    ("turn", "kept"), [("upside-down", [0, 0, 1]), ("inside-out", [0, 1, 0]), ("both", [1, 0, 0])]
)
def test_turned_sensors_are_half_a_turn_from_nominal(turn: str, kept: list[int]) -> None:
    sensor = session(Wearing(turned={"forearm_r": turn})).sensors["forearm_r"]  # type: ignore[dict-item]
    off = multiply(inverse(sensor.nominal_mounting), sensor.segment_from_sensor[0])
    assert np.degrees(angle_between(off, [1, 0, 0, 0])) == pytest.approx(180.0)
    assert rotate(off, np.array(kept, dtype=float)) == pytest.approx(kept)
    up = 1.0 if turn == "inside-out" else -1.0
    assert sensor.acc.mean(axis=0) == pytest.approx([0.0, up * G, 0.0], abs=1e-6)


def test_a_mounting_can_be_stated() -> None:
    q = (0.5, 0.5, -0.5, 0.5)
    s = session(Wearing(mounting={"hand_r": q}), errors=LEVELS["ideal"])
    assert angle_between(s.sensors["hand_r"].segment_from_sensor, q).max() < 1e-7
    assert s.sensors["hand_r"].nominal_mounting == pytest.approx([1.0, 0.0, 0.0, 0.0])


def test_errors_can_be_given_in_place_of_the_levels() -> None:
    off = []
    for seed in range(40):
        worse = replace(LEVELS["typical"], placement_deg=15.0)
        wearer = Wearer(WearerSettings(level="typical", errors=worse, seed=seed))
        strap = wearer.straps["forearm_r"]
        off.append(np.degrees(angle_between(strap.placement, strap.nominal)))
    assert np.sqrt(np.mean(np.square(off))) == pytest.approx(15.0, rel=0.2)


def test_one_strap_slips_by_eight_degrees_when_it_is_said() -> None:
    only = replace(EXACT, slip_deg=8.0)
    s = session(Wearing(slip_segment="forearm_r", slip_s=9.0), 15.0, only, exercise="reaching")
    assert s.slip == ("forearm_r", 9.0)
    for segment, sensor in s.sensors.items():
        mounted = sensor.segment_from_sensor
        moved = np.degrees(angle_between(mounted, mounted[:1]))
        assert moved[s.time_s <= 9.0].max() < 1e-5
        after = moved[s.time_s >= 9.3]
        assert after == pytest.approx(8.0 if segment == "forearm_r" else 0.0, abs=1e-5)


def test_a_slip_is_drawn_from_the_seed_and_only_where_the_level_has_one() -> None:
    drawn = [Wearer(WearerSettings(level="patient", seed=seed)).slip for seed in range(60)]
    segments, times = zip(*[slip for slip in drawn if slip], strict=True)
    assert len(times) == 60
    assert set(segments) == {"upper_arm_r", "forearm_r", "hand_r"}
    assert 10.0 <= min(times) < 15.0 < 35.0 < max(times) <= 40.0
    assert Wearer(WearerSettings(level="typical")).slip is None


@pytest.mark.parametrize(
    ("segment", "exercise", "name", "share"),
    [
        ("upper_arm_r", "external-rotation", "shoulder_rotation", 0.7),
        ("upper_arm_l", "external-rotation", "shoulder_rotation", 0.7),
        ("forearm_r", "forearm-rotation", "forearm_pronation", 0.9),
        ("forearm_l", "forearm-rotation", "forearm_pronation", 0.9),
    ],
)
def test_skin_follows_rotation_in_part(segment: str, exercise: str, name: str, share: float) -> None:
    lagging = replace(EXACT, humeral_lag=0.3, pronation_lag=0.1)
    side = "right" if segment.endswith("r") else "left"
    s = session(Wearing(), 14.0, lagging, exercise=exercise, arms=side)
    mounted = s.sensors[segment].segment_from_sensor  # type: ignore[index]
    turn = to_rotation_vector(multiply(mounted, inverse(mounted[0])))
    assert np.abs(turn[:, [0, 2]]).max() < 1e-9
    angle = s.arms[side].angles[name]  # type: ignore[index]
    anatomical = 1.0 if side == "right" else -1.0
    assert turn[:, 1] == pytest.approx(-anatomical * (1.0 - share) * angle, abs=1e-9)
    assert np.ptp(angle) > 1.5


def test_arrangements_are_where_the_experiments_had_them() -> None:
    lengths = from_height(1.8)
    along = {a: [-place(s, lengths, a).lever[1] for s in ("upper_arm_r", "forearm_r")] for a in ARRANGEMENTS}  # type: ignore[arg-type]
    upper, fore = lengths.upper_arm, lengths.forearm
    assert along["near-joints"] == pytest.approx([upper - 0.02, fore - 0.02])
    assert along["moved-away"] == pytest.approx([upper - 0.10, fore - 0.10])
    assert along["tracker"][0] == pytest.approx(0.05)
    for side, outwards in (("r", 1.0), ("l", -1.0)):
        palmar = place(f"forearm_{side}", lengths, "tracker")  # type: ignore[arg-type]
        assert outwards * palmar.lever[2] < 0.0  # towards the thigh, in neutral
        assert rotate(palmar.mounting, np.array([0.0, 0.0, 1.0])) == pytest.approx([0, 0, -outwards])


def test_the_hand_trembles_a_little_at_five_hertz_while_it_moves() -> None:
    def hand(tremor_deg: float) -> np.ndarray:
        errors = replace(LEVELS["patient"], tremor_deg=tremor_deg)
        moving = session(
            Wearing(), 70.0, errors, rate_hz=100.0, routine="calibration", exercise="wrist-flexion"
        )
        return moving.arms["right"].world_positions["hand"]

    off, t = hand(LEVELS["patient"].tremor_deg) - hand(0.0), np.arange(7000) / 100.0
    assert np.abs(off[t < 4.0]).max() < 1e-12
    assert 1e-4 < np.sqrt((off[t > 55.0] ** 2).sum(axis=1).mean()) < 1e-3
    assert np.abs(off[(t > 8.0) & (t < 20.0)]).max() > 1e-4  # the calibration's movements tremble too
    late = off[t > 55.0]
    spectrum = np.abs(np.fft.rfft(late * np.hanning(len(late))[:, None], axis=0)).sum(axis=1)
    assert 4.4 < np.fft.rfftfreq(len(late), 0.01)[spectrum.argmax()] < 5.6


@pytest.mark.parametrize(
    "wrong",
    [
        {"arrangement": "loose"},
        {"seats": {"hand_r": "foot_r"}},
        {"turned": {"hand_r": "sideways"}},
        {"mounting": {"hand_r": (1.0, 1.0, 0.0, 0.0)}},
    ],
)
def test_what_cannot_be_worn_is_refused_by_name(wrong: dict[str, object]) -> None:
    (value,) = wrong.values()
    named = str(next(iter(value.values())) if isinstance(value, dict) else value)
    with pytest.raises(ValueError, match=named.replace("(", r"\(").replace(")", r"\)")):
        Wearing(**wrong)  # type: ignore[arg-type]


def test_turns_are_half_turns_about_each_axis() -> None:
    assert sorted(np.flatnonzero(q).tolist() for q in TURNS.values()) == [[1], [2], [3]]
