"""The play: what is done to the node, act after act, and what it must do then."""

import math
import time
from collections.abc import Callable
from copy import deepcopy
from dataclasses import dataclass, field
from functools import partial
from itertools import pairwise
from statistics import median

import msgspec

from brachium_nodes import websocket_frames as ws
from brachium_nodes.conformance.heard import Heard
from brachium_nodes.conformance.rules import Verdict, failed, judged, not_claimed, ok
from brachium_nodes.conformance.stage import Caller, Stage
from brachium_nodes.conformance.trial import Trial
from brachium_nodes.node_frames import Keep, Refused, Welcome
from brachium_wire.codec import encode

REFUSALS = 3
SHORTEST_S, LONGEST_S = 0.2, 45.0
PAIRS, ENOUGH, NAGLED_S = 20, 10, 0.025
"""A small message that waits for an acknowledgement waits 40 ms on Linux, longer elsewhere."""
RETRY_S = 2.0
CALIBRATION = '{"gyro_bias": [0.0125, -0.0175, 0.0025]}'
UNKNOWN = b"\x82\xa1m\xa8spoon/99\xa1x\x01"
PONG_WITHIN_S = 2.0
LOOK_S = 0.5


@dataclass(kw_only=True)
class Play:
    """What all acts share: the trial's process and door, and everything that was heard."""

    trial: Trial
    stage: Stage
    heard: list[Heard] = field(default_factory=list)
    verdicts: list[Verdict] = field(default_factory=list)

    def call(self, within_s: float) -> Caller | None:
        """Return the node's next call, let in; None when it does not come."""
        caller = self.stage.accept(within_s)
        if caller is None:
            return None
        self.let_in(caller)
        return caller

    def let_in(self, caller: Caller) -> None:
        """Upgrade and welcome it."""
        caller.upgrade()
        caller.heard.life = self.trial.starts
        self.heard.append(caller.heard)
        greet(caller)

    def back(self, rule: str) -> Caller | None:
        """Return the node's call after it was cut off, and judge that it came; else start it anew."""
        begun = time.monotonic()
        caller = self.call(self.trial.patience.return_s)
        after_s = time.monotonic() - begun
        if caller is not None:
            self.verdicts.append(ok(rule, f"after {after_s:.1f} s"))
            return caller
        self.verdicts.append(failed(rule, f"nothing for {after_s:.0f} s"))
        return self.anew()

    def anew(self) -> Caller | None:
        """Start the node again and let it in."""
        self.trial.start()
        return self.call(self.trial.patience.start_s)


def greet(caller: Caller) -> None:
    """Wait for its hello and welcome it, with a field that no node knows."""
    caller.attend(3.0, ask=False, until=lambda h: h.messages)
    welcome = Welcome(subject="p01", segment="forearm_r", host="judge", time_ns=time.time_ns())
    caller.frame(ws.BINARY, msgspec.msgpack.encode({**msgspec.msgpack.decode(encode(welcome)), "xyz": [1]}))


def door(play: Play) -> bool:
    """Refuse it at the door some times; return whether it called at all."""
    first = play.stage.accept(play.trial.patience.start_s)
    if first is None:
        text = f"nobody called in {play.trial.patience.start_s:g} s{play.trial.end_told()}"
        play.verdicts.append(failed("request", text))
        return False
    play.verdicts.append(judged("request", first.request_fault(), "GET /node"))
    play.verdicts.append(judged("token", _token_fault(first, play.trial.token), "in the header alone"))
    times, ran = [time.monotonic()], not play.trial.ended()
    first.refuse()
    for _ in range(REFUSALS):
        caller = _calls_again(play, ran)
        if caller is None:
            break
        times.append(time.monotonic())
        caller.refuse()
    waits = [b - a for a, b in pairwise(times)]
    text = ", ".join(f"{wait:.2f} s" for wait in waits)
    if not waits and play.trial.ended():
        play.verdicts.append(not_claimed("back-off", "the command ends when its token is refused"))
        play.trial.start()
    elif len(waits) < REFUSALS:
        play.verdicts.append(failed("back-off", f"{len(waits)} more calls: {text}"))
    else:
        fine = min(waits) >= SHORTEST_S and max(waits) <= LONGEST_S and waits[-1] > waits[0]
        play.verdicts.append(judged("back-off", "" if fine else text, text))
    return True


def _calls_again(play: Play, ran: bool) -> Caller | None:
    """Return its next call. A command that ran until it was refused (`ran`) and has ended calls no more."""
    end_s = time.monotonic() + play.trial.patience.return_s
    while (left_s := end_s - time.monotonic()) > 0.0:
        over = ran and play.trial.ended()
        caller = play.stage.accept(min(left_s, LOOK_S))
        if caller is not None or over:
            return caller
    return None


def _token_fault(caller: Caller, token: str) -> str:
    given = caller.header("authorization")
    if given != f"Bearer {token}":
        return "no Authorization" if not given else "another Authorization"
    return "" if caller.head.count(token.encode()) == 1 else "the token a second time"


def quiet(play: Play, caller: Caller) -> Caller | None:
    """Let it work undisturbed; then ping it, say what it cannot know, and press its writer."""
    caller.attend(play.trial.patience.listen_s)
    one = caller.heard
    play.trial.quiet = deepcopy(one)
    play.verdicts.append(_no_delay(caller))
    caller.frame(ws.PING, b"judge-17")
    came = caller.attend(PONG_WITHIN_S, until=lambda h: h.pongs)
    fault = "" if came and one.pongs[-1] == b"judge-17" else f"{one.pongs[-1:] or 'no pong'}"
    play.verdicts.append(judged("pong", fault, "with the payload"))
    caller.frame(ws.BINARY, UNKNOWN)
    before = len(one.batches)
    lives = caller.attend(PONG_WITHIN_S, until=lambda h: len(h.batches) > before + 1)
    play.verdicts.append(
        judged("unknown", "" if lives else "no batch after a message of a new kind", "goes on")
    )
    return caller if lives else play.anew()


def _no_delay(caller: Caller) -> Verdict:
    """Ask twice in a row, again and again: the second answer must not wait for the first one's receipt."""
    apart: list[float] = []
    for asked in range(PAIRS):
        if asked - len(apart) > PAIRS - ENOUGH:
            break
        caller.acknowledge_late()
        due = len(caller.heard.exchanges) + 2
        caller.ask(2)
        caller.attend(1.0, ask=False, until=partial(_has, due))
        last = caller.heard.exchanges[due - 2 :]
        if len(last) == 2:
            apart.append((last[1].answered_ns - last[0].answered_ns) * 1e-9)
        caller.attend(0.05, ask=False)
    if len(apart) < ENOUGH:
        return not_claimed("no delay", "it answers no clock question")
    text = f"second of two answers {1e3 * median(apart):.1f} ms after the first, at the median"
    return judged("no delay", text if median(apart) > NAGLED_S else "", text)


def _has(exchanges: int, heard: Heard) -> bool:
    return len(heard.exchanges) >= exchanges


def keep(play: Play, caller: Caller) -> Caller | None:
    """Tell it a calibration, and close: its next hello must bring it."""
    caller.say(Keep(calibration=CALIBRATION))
    kept = caller.attend(PONG_WITHIN_S, until=lambda h: h.kept)
    caller.close(1001, "the judge ends")
    closed = caller.heard.closed is not None
    play.verdicts.append(judged("close", "" if closed else "no close frame", "close answered"))
    after = play.back("return after close")
    if not kept:
        play.verdicts.append(not_claimed("keep", "it leaves keep/1 aside"))
    elif after is not None and after.heard.hello is not None:
        bias = after.heard.hello.calibration.gyro_bias
        same = bias is not None and all(map(_close, bias, (0.0125, -0.0175, 0.0025)))
        play.verdicts.append(judged("keep", "" if same else f"gyro_bias {bias} in hello", "brought in hello"))
    return after


def _close(a: float, b: float) -> bool:
    return math.isclose(a, b, rel_tol=1e-4, abs_tol=1e-6)


def retry(play: Play, caller: Caller) -> Caller | None:
    """Refuse it with a time to wait."""
    caller.attend(0.5)
    caller.say(Refused(code="segment_taken", reason="the judge refuses", retry_s=RETRY_S))
    begun = time.monotonic()
    caller.close(4409, "the judge refuses")
    after = play.call(play.trial.patience.return_s)
    waited = time.monotonic() - begun
    if after is None:
        play.verdicts.append(failed("retry", f"nothing for {waited:.0f} s"))
        return play.anew()
    fault = f"again after {waited:.2f} s, told {RETRY_S:g} s" if waited < RETRY_S else ""
    play.verdicts.append(judged("retry", fault, f"again after {waited:.1f} s"))
    return after


def silence(play: Play, caller: Caller) -> Caller | None:
    """Fall silent: neither questions nor pongs."""
    begun = time.monotonic()
    after = play.stage.accept(play.trial.patience.silence_s)
    caller.reset()
    if after is None:
        waited = time.monotonic() - begun
        play.verdicts.append(failed("return after silence", f"still there after {waited:.0f} s"))
        return play.anew()
    play.verdicts.append(ok("return after silence", f"after {time.monotonic() - begun:.1f} s"))
    play.let_in(after)
    return after


def reset(play: Play, caller: Caller) -> Caller | None:
    """Break off."""
    caller.attend(0.5)
    caller.reset()
    return play.back("return after reset")


Act = Callable[[Play, Caller], Caller | None]
ACTS: tuple[Act, ...] = (quiet, keep, retry, reset, silence)
