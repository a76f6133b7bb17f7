"""The wear check: every node's seat and turn are named as they are, in words, or a reason why not."""

from collections.abc import Sequence
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from brachium_body import rotation
from brachium_body.segments import Segment, Side, arm_segments
from brachium_fusion.wear_check import WearCheck, WearFinding, WearPass, check_wear
from brachium_fusion.wear_features import Motion, WearRecord, felt
from brachium_nodes.sensors import Level
from brachium_nodes.session import session_arrays
from brachium_nodes.wearer import WearerSettings
from brachium_nodes.wearing import Turn, Wearing

RATE_HZ = 25.0
RIGHT, LEFT = arm_segments("right"), arm_segments("left")
SPANS: tuple[Motion, ...] = ("hang", "raise", "bend")
MIRROR: dict[Segment, Segment] = {
    **dict(zip(RIGHT, LEFT, strict=True)),
    **dict(zip(LEFT, RIGHT, strict=True)),
}


def one_pass(
    moved: Side,
    nodes: Sequence[Segment],
    wearing: Wearing,
    asked: Side | None = None,
    level: Level = "typical",
    seed: int = 3,
) -> WearPass:
    """Return a pass in which `moved` moves, and `asked` was asked for."""
    settings = WearerSettings(
        routine="wear-check",
        arms=moved,
        level=level,
        seed=seed,
        rate_hz=RATE_HZ,
        segments=tuple(nodes),
        wearing=wearing,
    )
    made = session_arrays(settings, 13.0)
    rows = {span.kind: (round(span.from_s * RATE_HZ), round(span.to_s * RATE_HZ)) for span in made.spans}
    records = {
        name: WearRecord(gyr=s.gyr, acc=s.acc, nominal_mounting=s.nominal_mounting)
        for name, s in made.sensors.items()
    }
    return WearPass(moved=asked or moved, records=records, spans={kind: rows[kind] for kind in SPANS})


def both_arms(wearing: Wearing, *, sternum: bool = False, level: Level = "typical") -> WearCheck:
    nodes: tuple[Segment, ...] = (*RIGHT, *LEFT, *(("sternum",) if sternum else ()))
    return check_wear([one_pass(side, nodes, wearing, level=level) for side in ("right", "left")], RATE_HZ)


def named(check: WearCheck) -> dict[Segment, tuple[Segment | None, str]]:
    assert check.refused == ""
    return {f.segment: (f.seat, f.turn) for f in check.findings}


def as_worn(
    nodes: Sequence[Segment], seats: dict[Segment, Segment], turned: dict[Segment, Turn]
) -> dict[Segment, tuple[Segment | None, str]]:
    return {n: (seats.get(n, n), turned.get(n, "")) for n in nodes}


def of(check: WearCheck, segment: Segment) -> WearFinding:
    return next(f for f in check.findings if f.segment == segment)


@pytest.mark.parametrize("level", ["typical", "patient"])
@pytest.mark.parametrize("side", ["right", "left"])
def test_nodes_worn_as_they_should_be_are_fine(side: Side, level: Level) -> None:
    check = check_wear([one_pass(side, arm_segments(side), Wearing(), level=level)], RATE_HZ)
    assert check.fine
    assert {f.text.split(": ")[1] for f in check.findings} == {"worn as it should be"}


def test_both_arms_and_a_sternum_sensor_are_fine() -> None:
    assert both_arms(Wearing(), sternum=True).fine


@pytest.mark.parametrize(("a", "b"), [(0, 1), (1, 2), (0, 2)])
def test_two_nodes_that_were_swapped_are_named(a: int, b: int) -> None:
    seats = {RIGHT[a]: RIGHT[b], RIGHT[b]: RIGHT[a]}
    check = check_wear([one_pass("right", RIGHT, Wearing(seats=seats))], RATE_HZ)
    assert named(check) == as_worn(RIGHT, seats, {})
    assert not check.fine
    said = of(check, RIGHT[a]).text
    assert f"is on the {RIGHT[b][:-2].replace('_', ' ')}" in said.replace("right ", "")
    assert f"swap it with {RIGHT[b]}" in said


@pytest.mark.parametrize(
    ("turn", "word"),
    [("upside-down", "is upside down"), ("inside-out", "its back to the outside"), ("both", "end to end")],
)
@pytest.mark.parametrize("segment", RIGHT)
def test_a_node_that_sits_turned_is_named(segment: Segment, turn: Turn, word: str) -> None:
    check = check_wear([one_pass("right", RIGHT, Wearing(turned={segment: turn}))], RATE_HZ)
    assert named(check) == as_worn(RIGHT, {}, {segment: turn})
    assert word in of(check, segment).text


def test_arms_that_were_exchanged_are_named() -> None:
    assert named(both_arms(Wearing(seats=MIRROR))) == as_worn((*RIGHT, *LEFT), MIRROR, {})


def test_all_nodes_on_the_other_arm_are_named() -> None:
    """The wearer moves the arm that wears them, whichever was asked for."""
    seats = {segment: MIRROR[segment] for segment in RIGHT}
    check = check_wear([one_pass("left", RIGHT, Wearing(seats=seats), asked="right")], RATE_HZ)
    assert named(check) == as_worn(RIGHT, seats, {})
    assert "is on the left forearm; move it to the right forearm" in of(check, "forearm_r").text


def test_swapped_and_turned_at_once_are_both_said() -> None:
    seats: dict[Segment, Segment] = {"forearm_r": "hand_r", "hand_r": "forearm_r"}
    check = check_wear(
        [one_pass("right", RIGHT, Wearing(seats=seats, turned={"hand_r": "upside-down"}))], RATE_HZ
    )
    assert named(check) == as_worn(RIGHT, seats, {"hand_r": "upside-down"})
    text = of(check, "hand_r").text
    assert "swap it with forearm_r" in text
    assert "upside down" in text


@pytest.mark.parametrize("nodes", [RIGHT[:2], RIGHT[1:], RIGHT[1:2]])
def test_fewer_nodes_are_told_as_well(nodes: tuple[Segment, ...]) -> None:
    turned: dict[Segment, Turn] = {"forearm_r": "both"}
    assert check_wear([one_pass("right", nodes, Wearing())], RATE_HZ).fine
    check = check_wear([one_pass("right", nodes, Wearing(turned=turned))], RATE_HZ)
    assert named(check) == as_worn(nodes, {}, turned)


@cache
def fine_pass() -> WearPass:
    return one_pass("right", RIGHT, Wearing())


def test_a_node_that_fits_nowhere_is_said_to() -> None:
    """A quarter turn about the skin is no way to wear it: no guess is made."""
    quarter = rotation.about(2, np.pi / 2)
    p = fine_pass()
    odd = p.records["forearm_r"]
    turned = replace(odd, gyr=rotation.rotate(quarter, odd.gyr), acc=rotation.rotate(quarter, odd.acc))
    check = check_wear([replace(p, records=p.records | {"forearm_r": turned})], RATE_HZ)
    assert not check.fine
    assert of(check, "forearm_r").seat is None
    assert "fits no segment" in of(check, "forearm_r").text
    assert of(check, "upper_arm_r").fine


def test_arms_that_did_not_hang_still_are_refused_by_name() -> None:
    p = fine_pass()
    gyr = p.records["hand_r"].gyr.copy()
    first, last = p.spans["hang"]
    gyr[first:last, 0] += 0.8 * np.sin(np.arange(last - first) * np.pi / RATE_HZ)
    check = check_wear(
        [replace(p, records=p.records | {"hand_r": replace(p.records["hand_r"], gyr=gyr)})], RATE_HZ
    )
    assert check.findings == ()
    assert "hand_r did not hang still" in check.refused
    assert "upper_arm_r" not in check.refused


def test_an_arm_that_was_not_raised_is_refused() -> None:
    p = fine_pass()
    check = check_wear([replace(p, spans=p.spans | {"raise": p.spans["hang"]})], RATE_HZ)
    assert not check.fine
    assert "raise it sideways to shoulder height" in check.refused


def test_an_elbow_that_was_not_bent_is_refused() -> None:
    p = fine_pass()
    check = check_wear([replace(p, spans=p.spans | {"bend": p.spans["hang"]})], RATE_HZ)
    assert "when the elbow was to be bent: bend it" in check.refused
    upper: dict[Segment, WearRecord] = {"upper_arm_r": p.records["upper_arm_r"]}
    alone = check_wear([replace(p, records=upper, spans=p.spans | {"bend": p.spans["hang"]})], RATE_HZ)
    assert "elbow" not in alone.refused


def test_another_movement_than_the_one_asked_for_blames_no_sensor() -> None:
    """The elbow was bent when the arm was to be raised, and the other way round."""
    p = fine_pass()
    exchanged: dict[Motion, tuple[int, int]] = {**p.spans, "raise": p.spans["bend"], "bend": p.spans["raise"]}
    check = check_wear([replace(p, spans=exchanged)], RATE_HZ)
    assert check.findings == ()
    assert "the movement that was asked for was not seen" in check.refused


def test_a_gyroscopes_bias_does_no_harm() -> None:
    p = fine_pass()
    biased = {s: replace(r, gyr=r.gyr + np.array([0.05, -0.03, 0.02])) for s, r in p.records.items()}
    assert check_wear([replace(p, records=biased)], RATE_HZ).fine


def test_the_distance_from_the_elbow_is_that_of_the_hand_and_of_the_forearm() -> None:
    """What tells forearm from hand: near the wrist, and beyond it."""
    p = fine_pass()
    fore, hand = (felt(p.records[s], p.spans, RATE_HZ).from_joint_m for s in ("forearm_r", "hand_r"))
    assert 0.18 < fore < 0.28
    assert fore + 0.06 < hand < fore + 0.18
