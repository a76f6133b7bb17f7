"""The last acts: a door that stays shut for a while, and the node's goodbye."""

from itertools import pairwise

from brachium_nodes.conformance.acts import Play
from brachium_nodes.conformance.heard import Heard
from brachium_nodes.conformance.rules import Verdict, failed, judged, not_claimed, ok
from brachium_nodes.conformance.stage import Caller

SETTLE_S = 2.5
"""After it came back: what it kept has gone out, and a status tells what it dropped."""
LATE_NS = 150_000_000


def outage(play: Play, caller: Caller) -> Caller | None:
    """Close the connection and keep the door shut for longer than a node keeps samples."""
    caller.attend(SETTLE_S)
    before = caller.heard
    caller.close(1001, "the judge ends")
    play.stage.shut()
    play.trial.wait(play.trial.patience.outage_s)
    play.stage.open()
    after = play.call(play.trial.patience.return_s)
    if after is None:
        play.verdicts += [failed(rule, "it did not come back after an outage") for rule in ("late", "drops")]
        return play.anew()
    after.attend(SETTLE_S)
    play.verdicts += [_late(after.heard), _drops(before, after.heard)]
    return after


def _late(after: Heard) -> Verdict:
    """What was taken before the connection, by the node's own clock, must be marked; and come in order."""
    if not after.exchanges or not after.batches:
        return not_claimed("late", "without clock answers or batches nobody knows")
    best = min(after.exchanges, key=lambda e: e.round_trip_ns)
    offset_ns = (best.asked_ns + best.answered_ns) // 2 - 500 * (best.answer.came_us + best.answer.left_us)
    late = [batch for _, batch, _ in after.batches if batch.late]
    for _, batch, measured in after.batches:
        taken_ns = offset_ns + 1000 * measured.device_us[-1]
        if taken_ns < after.began_ns - LATE_NS and not batch.late:
            age_s = (after.began_ns - taken_ns) * 1e-9
            return failed("late", f"samples from {age_s:.2f} s before the connection, not marked")
    for a, b in pairwise(late):
        if b.sequence < a.sequence:
            return failed("late", f"{b.sequence} after {a.sequence}")
    live_first = next((n for n, (_, batch, _) in enumerate(after.batches) if not batch.late), 0)
    if any(batch.late for _, batch, _ in after.batches[live_first:]):
        return failed("late", "kept samples after new ones")
    if not late:
        return not_claimed("late", "it keeps nothing for later")
    return ok("late", f"{len(late)} batches kept and marked")


def _drops(before: Heard, after: Heard) -> Verdict:
    """What is missing between the two connections must be what the node says it dropped."""
    if not before.batches or not after.batches:
        return failed("drops", "no batches")
    told = [status.dropped for _, status in after.statuses if status.dropped is not None]
    known = [status.dropped for _, status in before.statuses if status.dropped is not None]
    if not told:
        return not_claimed("drops", "its status tells no drops")
    came: set[int] = set()
    for one in (before, after):
        for _, batch, measured in one.batches:
            came |= set(range(batch.sequence, batch.sequence + len(measured)))
    missing = max(came) - min(came) + 1 - len(came)
    dropped = told[-1] - (known[-1] if known else 0)
    text = f"{missing} samples missing, {dropped} counted"
    return judged("drops", text if dropped != missing else "", text)


def goodbye(play: Play, caller: Caller | None) -> None:
    """Switch it off."""
    if caller is None:
        play.trial.stop()
        return
    caller.attend(1.0)
    play.trial.terminate()
    caller.attend(play.trial.patience.bye_s, until=lambda h: h.bye is not None)
    bye, batches = caller.heard.bye, caller.heard.batches
    if bye is not None:
        caller.close(1000, "bye")
    if bye is None:
        play.verdicts.append(not_claimed("bye", "it went without a word"))
    elif not batches:
        play.verdicts.append(failed("bye", "no batch before it"))
    else:
        due = max(batch.sequence + len(measured) for _, batch, measured in batches)
        fault = "" if bye.next_sequence >= due else f"next {bye.next_sequence}, but {due - 1} was sent"
        if not fault and bye.next_sequence > due + _second(caller.heard):
            fault = f"next {bye.next_sequence}, but the last sent was {due - 1}"
        play.verdicts.append(judged("bye", fault, f"next {bye.next_sequence}"))
    play.trial.stop()


def _second(heard: Heard) -> int:
    return round(heard.hello.rate_hz) if heard.hello is not None else 0
