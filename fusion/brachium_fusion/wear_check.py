"""The wear check: which node sits on which segment and side, and whether it is turned. Pure.

One arm at a time, 10 s: it hangs, is raised sideways and let down, the elbow is bent and straightened. In
segment axes (X forward, Y proximal, Z right) every segment feels up along Y; raising turns the whole arm
about -X (right) or +X (left); bending turns forearm and hand about +Z. Half turns of a sensor change two of
the three signs, the other arm one: so all can be told apart where a segment does both. Forearm and hand do
the same and differ by their distance from the elbow. What cannot be told: the segments of an arm that hangs
still from one another and from the sternum, and which side an upper arm is on when no other node moves with
it.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from math import radians
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.optimize import linear_sum_assignment

from brachium_body import rotation
from brachium_body.segments import SIDES, Segment, Side, arm_segments, part_of, side_of
from brachium_fusion.wear_features import Felt, Motion, Rows, WearRecord, felt
from brachium_fusion.wear_words import OTHER_MOVEMENT, TURN_WORDS, Turn, place

Floats = npt.NDArray[np.float64]
TURNS: dict[Turn, Floats] = {
    "": rotation.IDENTITY,
    "upside-down": rotation.about(2, np.pi),
    "inside-out": rotation.about(1, np.pi),
    "both": rotation.about(0, np.pi),
}
"""as_it_should_sit_from_as_it_sits, in sensor axes: z off the skin, y along the segment."""

DIRECTION_RAD = radians(25.0)
"""SD of a direction: sensors sit up to 15 deg off, people raise an arm somewhat in front of the body."""
STILL_RAD = radians(15.0)
"""SD of what a segment turns that should be still."""
TOO_LITTLE_RAD = radians(30.0)
"""An arm that was raised or bent turned at least this far."""
DISTANCE_M = 0.035
"""SD of the distance from the elbow: 5 % of length from height, and where on the segment the strap is."""
UNCLEAR = 14.0
"""Sum of squares above which a node fits nowhere: of some six normal terms one in fifty exceeds it."""
RESTLESS_RAD = radians(6.0)
"""An arm sways by a degree or two while it hangs."""
MARGIN = 4.0
"""Being as it should be is preferred by this much: one clear contradiction weighs more."""


@dataclass(frozen=True, slots=True, kw_only=True)
class WearPass:
    """One arm's check: all nodes' readings while it hung, was raised and bent."""

    moved: Side
    """The arm that was asked for."""
    records: dict[Segment, WearRecord]
    """By the segment each node is named for."""
    spans: dict[Motion, Rows]


@dataclass(frozen=True, slots=True, kw_only=True)
class WearFinding:
    """Where a node really sits."""

    segment: Segment
    """What its name says."""
    seat: Segment | None
    """Where it sits; None if it cannot be told."""
    turn: Turn
    text: str
    """What is so and what to change, for people."""

    @property
    def fine(self) -> bool:
        """Return whether there is nothing to change."""
        return self.seat == self.segment and not self.turn


@dataclass(frozen=True, slots=True, kw_only=True)
class WearCheck:
    """What a check found."""

    findings: tuple[WearFinding, ...]
    refused: str = ""
    """Why nothing can be said."""

    @property
    def fine(self) -> bool:
        """Return whether everybody may begin."""
        return not self.refused and all(f.fine for f in self.findings)


def check_wear(
    passes: Sequence[WearPass], rate_hz: float, forearm_m: float = 0.26, hand_m: float = 0.19
) -> WearCheck:
    """Return where each node sits, from one pass an arm, all with the same nodes.

    With nodes on both arms give both passes. With one arm's, the nodes may all be on the other arm, which
    then moved instead of the one that was asked for.
    """
    feelings: Feelings = [
        (p.moved, {s: felt(r, p.spans, rate_hz) for s, r in p.records.items()}) for p in passes
    ]
    for _, felt_now in feelings:
        if refused := _refusal(felt_now):
            return WearCheck(findings=(), refused=refused)
    nominal: dict[Segment, Floats] = {s: r.nominal_mounting for s, r in passes[0].records.items()}
    distances = {"forearm": forearm_m - 0.03, "hand": forearm_m + 0.41 * hand_m}
    ways = [_assign(nominal, feelings, distances)]
    if len(passes) == 1:
        mirrored: Feelings = [(_OTHER[moved], felt_now) for moved, felt_now in feelings]
        ways.append(_assign(nominal, mirrored, distances))
    chosen = min(ways, key=lambda way: sum(seat.cost for seat in way.values()))
    findings = tuple(_finding(s, chosen[s], nominal, len(passes)) for s in nominal)
    on_arms = [f for f in findings if side_of(f.segment) is not None]
    if len(on_arms) > 1 and all(f.seat is None for f in on_arms):
        return WearCheck(findings=(), refused=OTHER_MOVEMENT)
    return WearCheck(findings=findings)


_OTHER: dict[Side, Side] = {"right": "left", "left": "right"}
_OTHER_ARM: dict[Segment, Segment] = {
    segment: there
    for side in SIDES
    for segment, there in zip(arm_segments(side), arm_segments(_OTHER[side]), strict=True)
}
Feelings = list[tuple[Side, dict[Segment, Felt]]]


class _Seat(NamedTuple):
    segment: Segment
    turn: Turn
    cost: float


def _refusal(feelings: dict[Segment, Felt]) -> str:
    restless = [s for s, f in feelings.items() if f.restless_rad > RESTLESS_RAD]
    if restless:
        return (
            f"{', '.join(restless)} did not hang still at the beginning: let the arms hang for three seconds"
        )
    if not _moved(f.raised for f in feelings.values()):
        return "no sensor moved when the arm was to be raised: raise it sideways to shoulder height"
    bends = any(part_of(s) in ("forearm", "hand") for s in feelings)
    if bends and not _moved(f.bent for f in feelings.values()):
        return (
            "no sensor moved when the elbow was to be bent: bend it, the upper arm still, and straighten it"
        )
    return ""


def _moved(turns: Iterable[Floats]) -> bool:
    return any(float(np.linalg.norm(turn)) >= TOO_LITTLE_RAD for turn in turns)


def _assign(
    nominal: dict[Segment, Floats], feelings: Feelings, distances: dict[str, float]
) -> dict[Segment, _Seat]:
    """Return the cheapest way to seat all nodes, each seat taken once."""
    names = list(nominal)
    seats: list[Segment] = list(dict.fromkeys([*names, *(_OTHER_ARM.get(s, s) for s in names)]))
    best = [
        [
            min(
                (
                    _Seat(seat, turn, _cost(name, seat, turn, nominal[name], feelings, distances))
                    for turn in TURNS
                ),
                key=lambda option: option.cost,
            )
            for seat in seats
        ]
        for name in names
    ]
    rows, columns = linear_sum_assignment([[option.cost for option in row] for row in best])
    return {names[i]: best[i][j] for i, j in zip(rows.tolist(), columns.tolist(), strict=True)}


def _cost(
    name: Segment,
    seat: Segment,
    turn: Turn,
    nominal: Floats,
    feelings: Feelings,
    distances: dict[str, float],
) -> float:
    """Return the sum of squared misfits of one node on one seat, turned so."""
    mounting = _mounting_on(seat, nominal, name)
    sensor_from_segment = rotation.inverse(rotation.multiply(mounting, TURNS[turn]))
    up, outward, right = (rotation.rotate(sensor_from_segment, axis) for axis in np.eye(3)[[1, 0, 2]])
    part = part_of(seat)
    cost = 0.0 if seat == name and not turn else MARGIN
    for moved, felt_now in feelings:
        f, moves = felt_now[name], side_of(seat) == moved
        cost += _direction(f.up, up)
        cost += _direction(f.raised, -outward if moved == "right" else outward) if moves else _still(f.raised)
        if moves and part in distances:
            cost += _direction(f.bent, right)
            cost += ((f.from_joint_m - distances[part]) / DISTANCE_M) ** 2
        else:
            cost += _still(f.bent)
    return cost


def _mounting_on(seat: Segment, nominal: Floats, name: Segment) -> Floats:
    """Return segment_from_sensor of a node that is worn on another seat as its own place would be worn there.

    On the other arm the same place lies on the other side: half a turn about Y. The sternum has none of its
    own elsewhere.
    """
    if (side_of(seat) or "") == (side_of(name) or ""):
        return nominal
    return rotation.multiply(rotation.about(1, np.pi), nominal)


def _direction(measured: Floats, expected: Floats) -> float:
    length = float(np.linalg.norm(measured))
    off = float(np.arctan2(np.linalg.norm(np.cross(measured, expected)), measured @ expected))
    short = 0.0
    if length < TOO_LITTLE_RAD:
        short = ((TOO_LITTLE_RAD - length) / (0.25 * TOO_LITTLE_RAD)) ** 2
    return (off / DIRECTION_RAD) ** 2 + short


def _still(turned: Floats) -> float:
    return float(turned @ turned) / STILL_RAD**2


def _finding(segment: Segment, seat: _Seat, nominal: dict[Segment, Floats], passes: int) -> WearFinding:
    if seat.cost - MARGIN > UNCLEAR * passes:
        text = f"{place(segment)}: what it felt fits no segment; look how it is worn and repeat the check"
        return WearFinding(segment=segment, seat=None, turn="", text=text)
    said = []
    if seat.segment != segment:
        other = seat.segment
        said.append(f"is on the {place(other)}")
        said.append(f"swap it with {other}" if other in nominal else f"move it to the {place(segment)}")
    if seat.turn:
        said.append(TURN_WORDS[seat.turn])
    return WearFinding(
        segment=segment,
        seat=seat.segment,
        turn=seat.turn,
        text=f"{place(segment)}: " + ("; ".join(said) if said else "worn as it should be"),
    )
