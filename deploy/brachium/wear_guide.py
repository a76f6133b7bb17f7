"""Leads a wearer through the check, arm by arm, and collects what the sensors say meanwhile.

Time is that of the samples: an instruction holds until they have passed its end, so that spans and samples
agree whatever clock gave the samples their time, and however late they come.
"""

import threading
import time
from collections.abc import Callable, Sequence
from math import ceil
from statistics import median_high
from typing import NamedTuple

from brachium.wear_passes import CannotTell, Heard, Plan
from brachium_body.segments import SIDES, Side, side_of
from brachium_fusion.wear_features import Motion
from brachium_wire import keys
from brachium_wire.bus import Bus, Inbox

Say = Callable[[str], None]

LISTEN_S = 3.0
"""By then every node that is there has sent something."""
STALLED_S = 5.0
"""When most nodes are silent for so long the check is given up."""
READY_S = 3.0


class Step(NamedTuple):
    """One instruction; `motion` is None while nothing is measured."""

    motion: Motion | None
    seconds: float
    words: str


STEPS = (
    Step(None, READY_S, "now the {side} arm: let both arms hang, palms to the thighs"),
    Step("hang", 3.0, "hang still"),
    Step("raise", 3.5, "raise the {side} arm sideways to shoulder height, and let it down again"),
    Step("bend", 3.5, "bend the {side} elbow, the upper arm still, and straighten it again"),
)


class Guide:
    """One subject's check on a bus."""

    def __init__(self, bus: Bus, room: str, subject: str, say: Say, stop: threading.Event) -> None:
        self.heard = Heard()
        self._bus, self._say, self._stop = bus, say, stop
        self._who = f"subject {subject!r} in room {room!r}"
        self._infos = keys.subjects(room, "imu/*/info", subject)
        self._inboxes: tuple[Inbox, ...] = (
            bus.subscribe(self._infos),
            bus.subscribe(keys.subjects(room, "imu/*", subject)),
        )

    def run(self, asked: Sequence[Side]) -> list[Plan]:
        """Return what was asked for and when, for the arms `asked`, or all that carry a node.

        Raises CannotTell when there is no such node, when samples stop, or when `stop` is set.
        """
        self._listen()
        there = {side_of(name) for name in self.heard.sensors() if name in self.heard.newest_s}
        sides: list[Side] = [side for side in SIDES if side in (asked or there)]
        if not there:
            raise CannotTell(f"no samples of {self._who} come; is its gateway running, are its nodes on?")
        if absent := [side for side in sides if side not in there]:
            raise CannotTell(f"no node of {self._who} on the {absent[0]} arm sends samples")
        if not sides:
            raise CannotTell(f"no node of {self._who} is named for an arm; the check moves arms")
        at_s, plans = self._now_s(), []
        for side in sides:
            spans: dict[Motion, tuple[float, float]] = {}
            for step in STEPS:
                self._say(step.words.format(side=side))
                begin_s, at_s = at_s, at_s + step.seconds
                if step.motion is not None:
                    spans[step.motion] = (begin_s, at_s)
                self._until(at_s)
            plans.append(Plan(side, spans))
        self._let_the_others_come(at_s)
        return plans

    def _listen(self) -> None:
        for key, payload in self._bus.fetch(self._infos):
            self.heard.take(key, payload)
        self._say("listening for the sensors")  # the router answered, so it knows what we subscribed to
        end = time.monotonic() + LISTEN_S
        while time.monotonic() < end:
            self._take()
            if self.heard.infos and self.heard.infos.keys() <= self.heard.newest_s.keys():
                return

    def _until(self, end_s: float) -> None:
        """Count down until the samples have passed `end_s`."""
        before_s, moved_on = self._now_s(), time.monotonic()
        while (now_s := self._now_s()) < end_s:
            if ceil(end_s - now_s) < ceil(end_s - before_s):
                self._say(f"  {ceil(end_s - now_s)}")
            if now_s > before_s:
                before_s, moved_on = now_s, time.monotonic()
            elif time.monotonic() - moved_on > STALLED_S:
                raise CannotTell(
                    f"most nodes were silent for {STALLED_S:g} s (brachium monitor); repeat the check"
                )
            self._take()

    def _let_the_others_come(self, end_s: float) -> None:
        """Wait a moment for nodes whose last batch is still on its way."""
        end = time.monotonic() + 1.0
        while min(self.heard.newest_s.values()) < end_s and time.monotonic() < end:
            self._take()

    def _now_s(self) -> float:
        """Return the samples' time: that of the node in the middle, for one may be silent or ahead."""
        return median_high(self.heard.newest_s.values())

    def _take(self) -> None:
        """Take what has come, after a moment's wait."""
        if self._stop.is_set():
            raise CannotTell("stopped before its end")
        infos, batches = self._inboxes
        batches.wait(0.1)
        for key, payload in [*infos.drain(), *batches.drain()]:
            self.heard.take(key, payload)
