"""The rules of the node protocol that can be seen from outside, by name, and how one was kept."""

from dataclasses import dataclass
from typing import Literal

Outcome = Literal["ok", "failed", "not claimed"]

RULES: dict[str, str] = {
    "request": "asks for a WebSocket at /node: GET, version 13, a key of 16 bytes",
    "token": "presents its token as Authorization: Bearer, and nowhere else",
    "back-off": "refused with 401 it comes again, later each time, from 0.2 s up to 45 s",
    "hello": "says hello/1 first and once, with fields that can be used, and its own id",
    "frames": "sends whole, masked, unmixed WebSocket frames: one writer",
    "messages": "sends binary messages of at most 4096 bytes, of kinds that the protocol has",
    "batches": "sends batches whose blocks fit, finite and within what is believed",
    "sequence": "numbers samples on without a gap while it is connected",
    "device time": "its samples' times grow, over connections too",
    "rate": "takes as many samples a second as hello says, within 2 %",
    "fresh": "stamps samples by the clock that it answers with: none of the future, none old unless late",
    "clock answered": "answers every clock question, each with its number",
    "clock order": "reads t1 before t2, both within the question's round trip",
    "clock prompt": "answers within 100 ms, at the median",
    "clock rate": "its clock runs as ours, within 0.05 %",
    "status": "tells status/1 about once a second",
    "status fields": "battery, signal and drops are within what can be",
    "no delay": "switches Nagle's algorithm off: a second small message does not wait for the first",
    "pong": "answers a ping with its payload",
    "unknown": "leaves messages and fields aside that it does not know",
    "keep": "stores the calibration it is told and brings it in its next hello",
    "close": "answers a close with a close",
    "return after close": "comes again after a close",
    "return after reset": "comes again after a reset",
    "return after silence": "takes a gateway that has fallen silent for dead, and comes again",
    "retry": "refused with a time it comes again, not before",
    "boot": "keeps its boot number over connections",
    "late": "marks what it kept and sends afterwards late, oldest first",
    "drops": "counts every sample that it threw away while it was alone",
    "bye": "says goodbye with the next number when it is switched off",
    "proof": "finds a gateway by itself, and gives its token only to one that proves itself",
}

NEEDS: dict[str, tuple[str, ...]] = {
    "frames": tuple(
        rule for rule in RULES if rule not in ("request", "token", "back-off", "hello", "frames", "proof")
    ),
    "batches": ("sequence", "device time", "rate", "fresh", "unknown", "late", "drops", "bye"),
    "sequence": ("drops",),
    "device time": ("rate", "fresh", "late"),
    "clock order": ("fresh", "late"),
    "clock prompt": ("no delay",),
    "return after close": ("keep",),
}
"""What cannot be told of a node that breaks a rule: by what it breaks."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Verdict:
    """How one rule was kept, in one line."""

    rule: str
    outcome: Outcome
    says: str
    """What came; where it failed, what was expected, too."""


def ok(rule: str, says: str) -> Verdict:
    """Return that a rule was kept."""
    return Verdict(rule=rule, outcome="ok", says=says)


def failed(rule: str, says: str) -> Verdict:
    """Return that a rule was broken."""
    return Verdict(rule=rule, outcome="failed", says=f"expected: {RULES[rule]}; came: {says}")


def not_claimed(rule: str, says: str) -> Verdict:
    """Return that the node does not do what this rule is about."""
    return Verdict(rule=rule, outcome="not claimed", says=says)


def judged(rule: str, fault: str, says: str) -> Verdict:
    """Return a verdict: broken where there is a fault."""
    return failed(rule, fault) if fault else ok(rule, says)
