"""Leads a wearer through the check, arm by arm, and collects what the sensors say meanwhile. Pure.

Time is that of the samples: an instruction holds until they have passed its end, so that spans and samples
agree whatever clock gave the samples their time, and however late they come. Only waiting for samples is
measured with a clock of the caller's.
"""

from collections.abc import Mapping, Sequence
from math import ceil
from statistics import median_high
from typing import NamedTuple

from brachium_body.segments import SIDES, Segment, Side, side_of
from brachium_fusion.wear_check import WearCheck
from brachium_fusion.wear_features import Motion
from brachium_fusion.wear_passes import CannotTell, Heard, Outcome, Plan, examine, findings
from brachium_wire import keys
from brachium_wire.messages import Info
from brachium_wire.sensor_records import WearProgress, WearStep

LISTEN_S = 3.0
"""By then every node that is there has sent something."""
STALLED_S = 5.0
"""When most nodes are silent for so long the check is given up."""
LAST_BATCHES_S = 1.0
"""A node whose last batch is still on its way is waited for."""
READY_S = 3.0


class Step(NamedTuple):
    """One instruction; `motion` is None while nothing is measured."""

    name: WearStep
    motion: Motion | None
    seconds: float
    words: str


STEPS = (
    Step("ready", None, READY_S, "now the {side} arm: let both arms hang, palms to the thighs"),
    Step("hang", "hang", 3.0, "hang still"),
    Step("raise", "raise", 3.5, "raise the {side} arm sideways to shoulder height, and let it down again"),
    Step("bend", "bend", 3.5, "bend the {side} elbow, the upper arm still, and straighten it again"),
)
LISTENING = "listening for the sensors"
LONGEST_S = LISTEN_S + 2.0 * (sum(step.seconds for step in STEPS) + STALLED_S) + LAST_BATCHES_S
"""A check of both arms ends within this, when samples come in time."""


class WearGuide:
    """One subject's check as it runs; times are s of one monotonic clock."""

    def __init__(self, who: str, infos: Mapping[str, Info], asked: Sequence[Side], now_s: float) -> None:
        """`who` names the subject in what is said; `asked`: the arms, or none for all that carry a node."""
        self._who, self._asked = who, asked
        self.heard = Heard(infos)
        self._began_s = self._moved_on_s = now_s
        self._sides: list[Side] = []
        self._at = -1
        """-1: listening; then the instruction's number over all arms; in the end their count."""
        self._begin_s = self._end_s = self._newest_s = 0.0
        self._spans: dict[Side, dict[Motion, tuple[float, float]]] = {}
        self._refused = ""
        self.complete = False
        """Whether all has been heard, or nothing more will be: `outcome` tells the rest."""

    def take(self, place: keys.Key, payload: bytes, now_s: float) -> None:
        """Take one message of the subject."""
        if not self.complete:
            self.heard.take(place, payload)
            self.look(now_s)

    def look(self, now_s: float) -> None:
        """Go on where time or samples have passed what was waited for."""
        try:
            while not self.complete and self._passed(now_s):
                self._next(now_s)
        except CannotTell as refusal:
            self._refused, self.complete = str(refusal), True

    def outcome(self) -> Outcome:
        """Return what is found; it takes a moment, on whatever thread has time for it."""
        if self._refused:
            return Outcome(WearCheck(findings=(), refused=self._refused), {}, ())
        plans = [Plan(side, spans) for side, spans in self._spans.items()]
        return examine(self.heard.sensors(), plans)

    def progress(self, outcome: Outcome | None = None) -> WearProgress:
        """Return how far it is, or with the outcome what was found."""
        if outcome is not None:
            refused = outcome.check.refused
            return WearProgress(
                state="refused" if refused else "done",
                reason=refused,
                sides=list(self._sides),
                fine=outcome.fine,
                findings=findings(outcome),
                left_out={str(name): why for name, why in outcome.left_out.items()},
                assumed=list(outcome.assumed),
            )
        if not 0 <= self._at < len(STEPS) * len(self._sides):
            return WearProgress(
                state="running", reason=LISTENING if self._at < 0 else "", sides=list(self._sides)
            )
        side, step = self._now()
        return WearProgress(
            state="running",
            step=step.name,
            side=side,
            sides=list(self._sides),
            reason=step.words.format(side=side),
            left_s=max(0, ceil(self._end_s - self._newest_s)),
        )

    def _now(self) -> tuple[Side, Step]:
        return self._sides[self._at // len(STEPS)], STEPS[self._at % len(STEPS)]

    def _passed(self, now_s: float) -> bool:
        newest = self.heard.newest_s
        if self._at < 0:
            everybody = bool(newest) and self.heard.infos.keys() <= newest.keys()
            return everybody or now_s - self._began_s >= LISTEN_S
        if self._at >= len(STEPS) * len(self._sides):
            return min(newest.values()) >= self._begin_s or now_s - self._moved_on_s >= LAST_BATCHES_S
        samples_s = median_high(newest.values())  # of the node in the middle: one may be silent or ahead
        if samples_s > self._newest_s:
            self._newest_s, self._moved_on_s = samples_s, now_s
        elif now_s - self._moved_on_s > STALLED_S:
            raise CannotTell(
                f"most nodes were silent for {STALLED_S:g} s (brachium monitor); repeat the check"
            )
        return samples_s >= self._end_s

    def _next(self, now_s: float) -> None:
        if self._at < 0:
            self._sides = self._who_moves()
            self._end_s = self._newest_s = median_high(self.heard.newest_s.values())
        elif self._at >= len(STEPS) * len(self._sides):
            self.complete = True
            return
        else:
            side, step = self._now()
            if step.motion is not None:
                self._spans.setdefault(side, {})[step.motion] = (self._begin_s, self._end_s)
        self._at, self._moved_on_s, self._begin_s = self._at + 1, now_s, self._end_s
        if self._at < len(STEPS) * len(self._sides):
            self._end_s += self._now()[1].seconds

    def _who_moves(self) -> list[Side]:
        heard: list[Segment] = [name for name in self.heard.sensors() if name in self.heard.newest_s]
        there = {side_of(name) for name in heard}
        sides: list[Side] = [side for side in SIDES if side in (self._asked or there)]
        if not there:
            raise CannotTell(f"no samples of {self._who} come; is its gateway running, are its nodes on?")
        if absent := [side for side in sides if side not in there]:
            raise CannotTell(f"no node of {self._who} on the {absent[0]} arm sends samples")
        if not sides:
            raise CannotTell(f"no node of {self._who} is named for an arm; the check moves arms")
        return sides
