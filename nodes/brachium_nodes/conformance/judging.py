"""Verdicts over what was heard. Pure: records in, verdicts out."""

from itertools import pairwise
from statistics import median

from brachium_nodes.conformance.heard import Exchange, Heard
from brachium_nodes.conformance.rules import Verdict, failed, judged, not_claimed, ok
from brachium_nodes.node_frames import checked_status
from brachium_nodes.roster import wrong_hello
from brachium_wire.codec import WireError

RATE_WITHIN = 0.02
CLOCK_WITHIN = 0.0005
OLD_S = 3.0
"""A batch that is not late holds a second or so, and has some hundred ms on the way."""
PROMPT_NS = 100_000_000
PATIENCE_NS = 1_000_000_000
"""A question that others overtook by so much was not answered."""
LEAST_STATUSES, MOST_STATUSES = 0.6, 2.0
"""A second, on a busy machine."""


def over_all(heard: list[Heard], node: str) -> list[Verdict]:
    """Judge what holds on every connection."""
    return [
        _hello(heard, node),
        *(_faults(rule, heard) for rule in ("frames", "messages", "batches")),
        _device_time(heard),
        _boot(heard),
    ]


def quiet(one: Heard) -> list[Verdict]:
    """Judge a connection on which nothing was disturbed."""
    return [
        _sequence(one),
        _rate(one),
        _fresh(one),
        _answered(one),
        _order(one),
        _prompt(one),
        _clock_rate(one),
        _status(one),
        _status_fields(one),
    ]


def _hello(heard: list[Heard], node: str) -> Verdict:
    for one in heard:
        if "hello" in one.faults:
            return failed("hello", one.faults["hello"])
        if one.hello is None:
            continue
        wrong = wrong_hello(one.hello)
        if wrong or one.hello.node != node:
            return failed("hello", wrong or f"id {one.hello.node!r}, not {node!r}")
    first = next((one.hello for one in heard if one.hello is not None), None)
    if first is None:
        return failed("hello", "no hello")
    return ok("hello", f"{first.chip}, {first.rate_hz:g} Hz, firmware {first.firmware or 'not told'}")


def _faults(rule: str, heard: list[Heard]) -> Verdict:
    fault = next((one.faults[rule] for one in heard if rule in one.faults), "")
    count = sum(one.messages for one in heard)
    if rule == "batches" and not fault and not any(one.batches for one in heard):
        fault = "no batch at all"
    if not count and not fault:
        return not_claimed(rule, "no message came")
    return judged(rule, fault, f"{count} messages on {len(heard)} connections")


def _device_time(heard: list[Heard]) -> Verdict:
    newest: dict[int, int] = {}
    count = 0
    for one in heard:
        boot = one.hello.boot if one.hello is not None else -1
        for _, batch, measured in one.batches:
            count += 1
            if batch.late:
                continue
            if measured.device_us[0] <= newest.get(boot, -1):
                text = f"{measured.device_us[0]} us after {newest[boot]} us"
                return failed("device time", text)
            newest[boot] = measured.device_us[-1]
    return judged("device time", "" if count else "no batch", f"{count} batches")


def _boot(heard: list[Heard]) -> Verdict:
    boots: dict[int, list[int]] = {}
    for one in heard:
        if one.hello is not None:
            boots.setdefault(one.life, []).append(one.hello.boot)
    again = [life for life in boots.values() if len(life) > 1]
    if not again:
        return not_claimed("boot", "it never came a second time")
    most = max(len(set(life)) for life in again)
    return judged("boot", f"{most} boot numbers" if most > 1 else "", f"one over {len(again[0])} connections")


def _sequence(one: Heard) -> Verdict:
    for (_, before, measured), (_, after, _) in pairwise(one.batches):
        due = before.sequence + len(measured)
        if after.sequence != due:
            return failed("sequence", f"{after.sequence} where {due} was due")
    return judged("sequence", "" if len(one.batches) > 1 else "fewer than two batches", "no gap")


def _rate(one: Heard) -> Verdict:
    live = [m for _, b, m in one.batches if not b.late]
    if len(live) < 3 or one.hello is None:
        return failed("rate", f"{len(live)} batches")
    if wrong_hello(one.hello):
        return not_claimed("rate", "hello tells none that can be")
    count = sum(len(m) for m in live) - len(live[-1])
    span_s = (live[-1].device_us[0] - live[0].device_us[0]) * 1e-6
    rate = count / max(span_s, 1e-6)
    fault = f"{rate:.2f} a second" if abs(rate / one.hello.rate_hz - 1.0) > RATE_WITHIN else ""
    return judged("rate", fault, f"{rate:.3f} a second of {one.hello.rate_hz:g}")


def _quickest(one: Heard) -> Exchange | None:
    return min(one.exchanges, key=lambda e: e.round_trip_ns, default=None)


def _fresh(one: Heard) -> Verdict:
    best = _quickest(one)
    if best is None:
        return not_claimed("fresh", "without clock answers nobody knows")
    offset_ns = (best.asked_ns + best.answered_ns) // 2 - 500 * (best.answer.came_us + best.answer.left_us)
    for now_ns, batch, measured in one.batches:
        age_s = (now_ns - offset_ns - 1000 * measured.device_us[-1]) * 1e-9
        if age_s < -best.round_trip_ns * 1e-9 - CLOCK_WITHIN * 60.0:
            return failed("fresh", f"a sample {-age_s:.3f} s in the future")
        if age_s > OLD_S and not batch.late:
            return failed("fresh", f"a sample {age_s:.1f} s old that is not marked late")
    return ok("fresh", f"{len(one.batches)} batches")


def _answered(one: Heard) -> Verdict:
    asked = len(one.exchanges) + len(one.asked)
    if "clock answered" in one.faults:
        return failed("clock answered", one.faults["clock answered"])
    if asked and not one.exchanges:
        return failed("clock answered", f"no answer to {asked} questions")
    if not asked:
        return not_claimed("clock answered", "the trial did not come so far")
    newest_ns = max((e.asked_ns for e in one.exchanges), default=0)
    left = sum(asked_ns < newest_ns - PATIENCE_NS for asked_ns in one.asked.values())
    return judged(
        "clock answered", f"{left} of {asked} without an answer" if left else "", f"{asked} questions"
    )


def _order(one: Heard) -> Verdict:
    for e in one.exchanges:
        thought_ns = 1000 * (e.answer.left_us - e.answer.came_us)
        if thought_ns < 0 or thought_ns > e.round_trip_ns + 1000:
            return failed(
                "clock order",
                f"t1 {e.answer.came_us}, t2 {e.answer.left_us} us in a round trip of "
                f"{e.round_trip_ns / 1000:.0f} us",
            )
    for a, b in pairwise(one.exchanges):
        if b.answer.came_us < a.answer.left_us:
            return failed("clock order", f"t1 {b.answer.came_us} before the last t2 {a.answer.left_us}")
    return _if_any("clock order", one, f"{len(one.exchanges)} answers")


def _prompt(one: Heard) -> Verdict:
    if not one.exchanges:
        return _if_any("clock prompt", one, "")
    trips = sorted(e.round_trip_ns for e in one.exchanges)
    middle_ms = median(trips) * 1e-6
    text = f"median {middle_ms:.1f} ms, longest {trips[-1] * 1e-6:.1f} ms"
    return judged("clock prompt", text if middle_ms > PROMPT_NS * 1e-6 else "", text)


def _clock_rate(one: Heard) -> Verdict:
    if len(one.exchanges) < 4:
        return _if_any("clock rate", one, "too few answers")
    half = len(one.exchanges) // 2
    ends = [min(part, key=lambda e: e.round_trip_ns) for part in (one.exchanges[:half], one.exchanges[half:])]
    passed_ns = ends[1].asked_ns - ends[0].asked_ns
    told_ns = 1000 * (ends[1].answer.came_us - ends[0].answer.came_us)
    doubt_ns = ends[0].round_trip_ns + ends[1].round_trip_ns
    off = max(0, abs(told_ns - passed_ns) - doubt_ns) / max(passed_ns, 1)
    fault = f"off by {100 * off:.2f} %" if off > CLOCK_WITHIN else ""
    return judged("clock rate", fault, f"{passed_ns * 1e-9:.1f} s, {doubt_ns * 1e-6:.1f} ms of doubt")


def _if_any(rule: str, one: Heard, says: str) -> Verdict:
    return ok(rule, says) if one.exchanges else not_claimed(rule, "it answers no clock question")


def _status(one: Heard) -> Verdict:
    times = [at_ns for at_ns, _ in one.statuses]
    if len(times) < 2:
        return failed("status", f"{len(times)} in the whole time")
    every_s = (times[-1] - times[0]) * 1e-9 / (len(times) - 1)
    fault = "" if LEAST_STATUSES <= every_s <= MOST_STATUSES else f"every {every_s:.1f} s"
    return judged("status", fault, f"every {every_s:.2f} s")


def _status_fields(one: Heard) -> Verdict:
    claimed: set[str] = set()
    for _, status in one.statuses:
        try:
            checked_status(status)
        except WireError as error:
            return failed("status fields", str(error))
        names = ("battery_v", "battery_hours", "rssi_dbm", "dropped")
        claimed |= {name for name in names if getattr(status, name) is not None}
    if not claimed:
        return not_claimed("status fields", "it tells none")
    return ok("status fields", ", ".join(sorted(claimed)))
