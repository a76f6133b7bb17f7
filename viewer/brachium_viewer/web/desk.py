"""What a page asks for, done: commands on the bus, marks into the recording, sets begun and ended."""

import asyncio
import logging
from contextlib import suppress
from typing import Any

from brachium_viewer import marks
from brachium_viewer.exercises import exercise
from brachium_viewer.web import requests as r
from brachium_viewer.web.page_state import PageState
from brachium_viewer.web.session_desk import NoRecording, SessionDesk, Unreached
from brachium_wire import keys
from brachium_wire.bus import LEASE_MS, Bus
from brachium_wire.codec import WireError, decode, encode
from brachium_wire.hosttime import HostClock
from brachium_wire.messages import Answer, Command, Session

log = logging.getLogger(__name__)

Json = dict[str, Any]

LONGEST_S = 300.0
"""No calibration takes longer; fusion itself gives up earlier."""
HEARD_S = 1.0
BACK_S = 0.5
"""Between two looks whether the recording can be reached again."""
OWED_S = LEASE_MS / 1000 + 2 * BACK_S
"""A report waits so long for the end of a set: a look at a router that vanished takes until its line is
noticed to be dead."""
STOPPED_UNWRITTEN = (
    "stopped, but that is not written yet: it is as soon as the router and the recorder are back"
)


class Refused(ValueError):
    """What cannot be done now: one line that says why and what to do."""


class Desk:
    """Does what pages ask, one thing a call; every failure is one line to the page that asked."""

    def __init__(self, bus: Bus, state: PageState, sessions: SessionDesk, clock: HostClock) -> None:
        self._bus, self._state, self._sessions, self._clock = bus, state, sessions, clock
        self._calibrating = False
        self._recording = asyncio.Lock()
        """Held by who begins, marks or ends: nothing is put into a recording that another closes."""
        self._owed: set[asyncio.Task[None]] = set()
        """Ends of sets that may not have come to the recording."""

    async def do(self, text: str) -> Json:
        """Return the answer to one message of a page."""
        verb, number = "", 0
        try:
            asked = r.read(text)
            verb, number = str(asked.__struct_config__.tag), asked.id
            data = await self._do(asked)
        except r.BadRequest as error:
            log.warning("a page asked for %r: %s", error.verb, error.wrong)
            return _answer(error.id, error.verb, reason=str(error))
        except ValueError as error:  # every part's own words on what cannot be
            return _answer(number, verb, reason=str(error))
        except Exception as error:
            log.exception("doing %s", verb)
            line = " ".join(str(error).split())[:200] or type(error).__name__
            return _answer(number, verb, reason=f"failed inside: {line}; see the server's log")
        return _answer(number, verb, data=data)

    async def _do(self, asked: r.Any) -> Json:
        if isinstance(asked, r.Subject):
            return self._subject(asked)
        subject = self._state.subject
        if isinstance(asked, r.PatientStop):
            return await self._patient_stop(subject, asked)
        if subject is None:
            raise Refused("nobody is chosen: choose a subject first")
        match asked:
            case r.Calibrate():
                arguments = {"routine": asked.routine, "pose": asked.pose, "seconds": asked.seconds}
                return await self._calibrate(subject, "calibrate", arguments)
            case r.Zero():
                return await self._calibrate(subject, "zero", {})
            case r.WearCheck():
                return await self._wear_check(subject)
            case r.Exercise():
                async with self._recording:
                    return await self._begin(subject, asked)
            case r.Plan():
                return self._plan(subject, asked)
            case r.Stop():
                ended = await self._end(subject, "stopped")
                if not await self._sessions.reached(self._bus):
                    raise Refused(STOPPED_UNWRITTEN)
                return ended
            case r.Report():
                return await self._finish(subject, asked.language)
            case r.Mark():
                return await self._mark(subject, marks.Note(), asked.text)
            case r.Donning():
                return await self._mark(subject, marks.Donning())
            case r.Pain():
                return await self._mark(subject, marks.Pain(value=asked.value, when=asked.when))
            case r.Effort():
                return await self._mark(subject, marks.Effort(value=asked.value, when=asked.when))

    def _subject(self, asked: r.Subject) -> Json:
        if asked.create and self._state.known(asked.subject):
            raise Refused(f"{asked.subject} is there already: choose it")
        if not asked.create and not self._state.known(asked.subject):
            raise Refused(f"{asked.subject} is not known here: create it first")
        if self._sessions.subject not in (None, asked.subject):
            raise Refused(f"a session of {self._sessions.subject} is recorded: end it first, under Finish")
        self._state.choose(asked.subject)
        if asked.create:
            told = Session(side=asked.side, height_m=asked.height_m)
            self._bus.retain(keys.session(self._state.room, asked.subject), encode(told))
        return {"subject": asked.subject}

    async def _calibrate(self, subject: str, verb: str, arguments: Json) -> Json:
        if self._state.running is not None:
            raise Refused("a set is running: stop it first")  # its angles would jump
        if self._calibrating:
            raise Refused("a calibration is running: wait until it is over")
        self._calibrating = True
        try:
            answer = await self._ask(subject, verb, arguments, LONGEST_S)
        finally:
            self._calibrating = False
        if answer is None:
            raise Refused("fusion does not answer; is brachium fuse running in this room?")
        if not answer.ok:
            raise Refused(answer.reason)
        return answer.data

    async def _wear_check(self, subject: str) -> Json:
        answer = await self._ask(subject, "wear-check", {}, LONGEST_S)
        if answer is None:
            raise Refused(f"in a terminal: brachium wear-check --subject {subject}")
        if not answer.ok:
            raise Refused(answer.reason)
        return answer.data

    def _plan(self, subject: str, asked: r.Plan) -> Json:
        self._state.plans.mean(subject, _begins(asked))
        return {}

    async def _begin(self, subject: str, asked: r.Exercise) -> Json:
        if asked.side not in self._state.sides():
            raise Refused(f"no skeletons of the {asked.side} arm come: are its sensors on?")
        if self._state.running is not None:
            raise Refused("a set is running: stop it first")
        begins = _begins(asked)
        await self._sessions.begin(self._bus, subject, anew=True, language=asked.language)
        now_ns = self._instant_ns()
        self._state.begin(begins, now_ns)
        self._put(subject, begins, now_ns)
        return {}

    async def _end(self, subject: str, reason: marks.Ended, *, none_is_fine: bool = False) -> Json:
        running = self._state.running
        if running is None:
            if none_is_fine:
                return {}
            raise Refused("no set is running")
        done = running.progress().done and reason == "stopped"
        mark, now_ns = marks.ExerciseEnds(reason="done" if done else reason), self._instant_ns()
        self._put(subject, mark, now_ns)
        ended = self._state.end()
        task = asyncio.create_task(self._put_again(subject, mark, now_ns))
        self._owed.add(task)
        task.add_done_callback(self._owed.discard)
        return {"set": ended}

    async def _put_again(self, subject: str, mark: marks.Mark, now_ns: int) -> None:
        """Put what was put while nothing was recorded, once it is again; whoever asked may be gone."""
        lost = False
        while not await self._sessions.reached(self._bus):
            lost = True
            await asyncio.sleep(BACK_S)
        if lost:
            self._put(subject, mark, now_ns)

    async def _patient_stop(self, subject: str | None, asked: r.PatientStop) -> Json:
        self._state.stopped = asked.reason  # every screen is told, whatever becomes of the recording
        if subject is None:
            return {}  # nothing runs, and nothing is recorded
        ended = await self._end(subject, "patient-stop", none_is_fine=True)
        try:
            with suppress(NoRecording):  # it shows an alarm of its own
                await self._mark(subject, marks.PatientStop(reason=asked.reason))
        except Unreached:
            raise Refused(STOPPED_UNWRITTEN) from None
        return ended

    async def _finish(self, subject: str, language: str) -> Json:
        async with self._recording:
            if self._state.running is not None:
                await self._end(subject, "stopped")
            if self._owed:
                await asyncio.wait(self._owed, timeout=OWED_S)
            await asyncio.sleep(HEARD_S)  # what was said last is still on its way to the recording
            closed = await self._sessions.end()
            self._state.plans.over(subject)
        return await self._sessions.keep(closed, subject, language)

    async def _mark(self, subject: str, mark: marks.Mark, text: str = "") -> Json:
        async with self._recording:
            await self._sessions.begin(self._bus, subject)
            self._put(subject, mark, self._instant_ns(), text)
        return {}

    def _put(self, subject: str, mark: marks.Mark, now_ns: int, text: str = "") -> None:
        self._bus.put(keys.event(self._state.room, subject), encode(marks.event(mark, now_ns, text)))

    def _instant_ns(self) -> int:
        return self._state.instant_ns(self._clock.now_ns())

    async def _ask(self, subject: str, verb: str, arguments: Json, timeout_s: float) -> Answer | None:
        key = keys.command(self._state.room, subject, verb)
        question = encode(Command(arguments=arguments))
        reply = await asyncio.to_thread(self._bus.ask, key, question, timeout_s)
        if reply is None:
            return None
        try:
            return decode(reply, Answer)
        except WireError as error:
            raise Refused(f"the answer cannot be read: {error}") from None


def _begins(asked: r.Plan) -> marks.ExerciseBegins:
    """Return what is meant. Raises Refused where who follows the goal would pass the limit."""
    rises = exercise(asked.exercise).rises
    if asked.goal_deg is not None and asked.limit_deg is not None:
        over = asked.goal_deg - asked.limit_deg
        if (over if rises else -over) > 0:
            raise Refused("the goal lies beyond the limit: change one of them")
    return asked.begins()


def _answer(number: int, verb: str, *, data: Json | None = None, reason: str = "") -> Json:
    ok = data is not None
    return {"kind": "answer", "id": number, "verb": verb, "ok": ok, "reason": reason, "data": data}
