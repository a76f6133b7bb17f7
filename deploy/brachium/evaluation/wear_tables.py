"""The wear check on 200 emulated wearers: right, swapped, turned, and on the other arm."""

from dataclasses import dataclass

import numpy as np

from brachium.evaluation.context import Context
from brachium.evaluation.tables import Cell, Limit, Table
from brachium_body.segments import SIDES, Segment, Side, arm_segments
from brachium_fusion.wear_check import WearFinding, WearPass, check_wear
from brachium_fusion.wear_features import WearRecord
from brachium_nodes.person import Person
from brachium_nodes.session import session_arrays
from brachium_nodes.wearer import WearerSettings
from brachium_nodes.wearing import TURNS, Turn, Wearing

WEARERS, QUICK_WEARERS = 200, 20
RATE_HZ = 25.0
KINDS = ("as it should be", "two on one arm swapped", "one turned", "arms exchanged", "swapped and turned")


@dataclass(frozen=True, slots=True)
class Case:
    """One wearer and what is wrong."""

    kind: str
    seed: int
    nodes: tuple[Segment, ...]
    seats: dict[Segment, Segment]
    turned: dict[Segment, Turn]

    @property
    def sides(self) -> tuple[Side, ...]:
        """Return the arms that are asked for, each in its own pass."""
        return tuple(side for side in SIDES if any(node.endswith(f"_{side[0]}") for node in self.nodes))


def case(number: int) -> Case:
    """Return a wearer: nodes on one arm or on both, and one of the kinds in turn."""
    random = np.random.default_rng(number)
    kind, both = KINDS[number % len(KINDS)], number // len(KINDS) % 2 == 1
    side: Side = SIDES[number // (2 * len(KINDS)) % 2]
    arms = SIDES if both or kind == "arms exchanged" else (side,)
    nodes: tuple[Segment, ...] = tuple(segment for arm in arms for segment in arm_segments(arm))
    seats: dict[Segment, Segment] = {}
    turned: dict[Segment, Turn] = {}
    if "swapped" in kind:
        on_one = arm_segments(arms[int(random.integers(len(arms)))])
        a, b = random.choice(3, size=2, replace=False).tolist()
        seats = {on_one[a]: on_one[b], on_one[b]: on_one[a]}
    if kind == "arms exchanged":
        for right, left in zip(arm_segments("right"), arm_segments("left"), strict=True):
            seats |= {right: left, left: right}
    if "turned" in kind:
        turns = tuple(TURNS)
        turned[nodes[int(random.integers(len(nodes)))]] = turns[int(random.integers(len(turns)))]
    return Case(kind, number, nodes, seats, turned)


def findings(worn: Case) -> tuple[WearFinding, ...]:
    """Return what the wear check says of a wearer, after one pass for each arm."""
    passes = []
    for side in worn.sides:
        settings = WearerSettings(
            exercise="elbow-flexion",
            routine="wear-check",
            arms=side,
            level="typical",
            seed=worn.seed,
            rate_hz=RATE_HZ,
            segments=worn.nodes,
            wearing=Wearing(seats=worn.seats, turned=worn.turned),
        )
        made = session_arrays(settings, Person(settings).begins_s)
        rows = {
            span.kind: (round(span.from_s * RATE_HZ), round(span.to_s * RATE_HZ))
            for span in made.spans
            if span.kind in ("hang", "raise", "bend")
        }
        records = {
            name: WearRecord(gyr=s.gyr, acc=s.acc, nominal_mounting=s.nominal_mounting)
            for name, s in made.sensors.items()
        }
        passes.append(WearPass(moved=side, records=records, spans=rows))  # type: ignore[arg-type]
    return check_wear(passes, RATE_HZ).findings


def named_rightly(worn: Case, found: tuple[WearFinding, ...]) -> bool:
    """Return whether every node's seat and turn were told as they are."""
    return len(found) == len(worn.nodes) and all(
        f.seat == worn.seats.get(f.segment, f.segment) and f.turn == worn.turned.get(f.segment, "")
        for f in found
    )


def wear(context: Context) -> list[Table]:
    """Return how many wearers were named rightly, by what was wrong, and how many false alarms there were."""
    count = QUICK_WEARERS if context.quick else WEARERS
    right: dict[str, list[bool]] = {kind: [] for kind in KINDS}
    alarms: list[bool] = []
    for number in range(count):
        if number % 20 == 0:
            context.progress(f"wear check: {number} of {count}")
        worn = case(number)
        found = findings(worn)
        right[worn.kind].append(named_rightly(worn, found))
        if worn.kind == KINDS[0]:
            alarms.append(not all(f.fine for f in found) or not found)
    rows: list[tuple[str, tuple[Cell, ...]]] = [
        (kind, (float(len(of)), 100.0 * float(np.mean(of)))) for kind, of in right.items()
    ]
    total = [value for of in right.values() for value in of]
    named, alarmed = 100.0 * float(np.mean(total)), 100.0 * float(np.mean(alarms))
    rows.append(("all", (float(count), named)))
    rows.append((f"false alarms, of those {KINDS[0]}", (float(len(alarms)), alarmed)))
    return [
        Table(
            name="wear-check",
            title=f"The wear check on {count} emulated wearers, typical",
            unit="%",
            columns=("wearers", "named rightly"),
            rows=tuple(rows),
            limits=(
                Limit(what="named rightly", value=named, at_most=99.0, unit="%", at_least=True),
                Limit(what="false alarms", value=alarmed, at_most=1.0, unit="%"),
            ),
            notes=(
                "Three nodes on one arm or on each. Straps 10 deg off (3-D rms), skin as at that level. A "
                "wearer counts as named rightly when the segment, side and turn of every node are.",
            ),
        )
    ]
