"""A session as the pages keep it: its recording, what is stored of it, and its report."""

import asyncio
import logging
import re
import threading
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

from brachium_viewer import recorder
from brachium_viewer.catalogue import ENGLISH
from brachium_viewer.web import keeping
from brachium_wire import keys
from brachium_wire.bus import Bus

log = logging.getLogger(__name__)

Json = dict[str, Any]

READY_S = 10.0
LOOK_S = 0.05
CLOSE_S = 20.0
_REPORT = re.compile(r"[A-Za-z0-9_-][A-Za-z0-9_.-]{0,120}")


class NoRecording(ValueError):
    """There is no recording, or it did not begin: one line that says why."""


class Unreached(ValueError):
    """Router or recorder are gone, so nothing is kept: one line that says so."""

    def __init__(self) -> None:
        super().__init__("the router or the recorder cannot be reached: nothing is recorded until it is back")


class SessionDesk:
    """One session at a time; its recorder runs in a thread of its own. Called on one event loop."""

    def __init__(self, folder: Path, endpoint: str, room: str, recorder_id: str) -> None:
        self.folder = folder
        self._settings = recorder.RecordSettings(endpoint=endpoint, room=room, folder=folder, id=recorder_id)
        self._token = keys.services(room, f"recorder/{self._settings.id}/alive")
        self._stop = threading.Event()
        self._thread: threading.Thread | None = None
        self._closed: recorder.RecordReport | None = None
        self._begun_s = 0.0
        self._looking: set[asyncio.Task[None]] = set()
        self._history: tuple[str | None, list[Json]] = (None, [])
        self.subject: str | None = None
        """Whose session is recorded."""
        self.failure = ""
        """Why recording did not begin or stopped; until another one has begun."""

    async def begin(self, bus: Bus, subject: str, *, anew: bool = False, language: str = ENGLISH) -> None:
        """Record from now on, if not yet. Raises NoRecording, and Unreached while nothing can be kept.

        One call at a time. Where a recording stopped by itself, only `anew` begins the next one: whoever
        asks has seen the alarm; what there was gets its report in `language`.
        """
        if self._thread is not None and self.failure:
            if not anew:
                raise NoRecording(self.failure)
            await asyncio.to_thread(self.close)
            if self._closed is not None:
                self._later(self._keep_aside(self._closed.path, subject, language))
        if not await self.reached(bus):
            raise Unreached
        if self._thread is None:
            await asyncio.to_thread(self._start, bus, subject)

    async def reached(self, bus: Bus) -> bool:
        """Return whether what is put now comes to the recording; before one, whether there is a router."""
        if self._thread is None:
            return bus.connected()
        return bool(await asyncio.to_thread(bus.alive, self._token))

    async def end(self) -> recorder.RecordReport:
        """Close the recording. Raises NoRecording when there was none."""
        if self._thread is None:
            raise NoRecording("nothing was recorded yet: start an exercise first")
        await asyncio.to_thread(self.close)
        if self._closed is None:
            raise NoRecording(self.failure or "the recording could not be closed")
        return self._closed

    async def keep(self, closed: recorder.RecordReport, subject: str, language: str) -> Json:
        """Keep the session of a closed recording and make its report; the next one may run already."""
        try:
            kept = await asyncio.to_thread(keeping.apart, keeping.keep, closed.path, subject, language)
        finally:
            self._history = None, []
        return {"recording": closed.path.name, "subject": subject, "ended": closed.ended, **kept}

    def state(self, subject: str | None, *, connected: bool = True) -> Json:
        """Return what a page shows of the recording, of alarms and of what was before."""
        if subject is not None and subject != self._history[0]:
            self._history = subject, []
            self._later(self._look(subject))
        alarms = [{"what": "recording", "reason": self.failure}] if self.failure else []
        if not connected:
            alarms.append({"what": "router", "reason": ""})
        return {"recording": self._recording(connected), "alarms": alarms, "history": self._history[1]}

    def report_file(self, name: str) -> Path | None:
        """Return the page of a session's report; None for one that is not there."""
        if not _REPORT.fullmatch(name):
            return None
        path = self.folder / f"{name}.html"
        return path if path.is_file() else None

    def close(self) -> None:
        """End the recorder, if it runs."""
        thread, self._thread = self._thread, None
        self._stop.set()
        self.subject = None
        if thread is not None:
            thread.join(CLOSE_S)

    def _recording(self, connected: bool) -> Json:
        if self.failure:
            return {"state": "failed", "seconds": None}
        if self._thread is None:
            return {"state": "off", "seconds": None}
        if not connected:
            return {"state": "cut", "seconds": None}
        return {"state": "on", "seconds": round(time.monotonic() - self._begun_s)}

    def _start(self, bus: Bus, subject: str) -> None:
        before, self.failure = self.failure, ""
        self._stop, self._closed = threading.Event(), None
        deadline = time.monotonic() + READY_S
        while bus.alive(self._token) and time.monotonic() < deadline:  # of the recording before
            time.sleep(LOOK_S)
        thread = threading.Thread(target=self._run, args=(subject, self._stop), name="recorder")
        thread.start()
        deadline = time.monotonic() + READY_S
        while not bus.alive(self._token):  # until then, what is put is not recorded
            if not thread.is_alive() or time.monotonic() > deadline:
                self._stop.set()
                why = self.failure or f"the recorder did not start within {READY_S:.0f} s"
                self.failure = self.failure or before
                raise NoRecording(why)
            time.sleep(LOOK_S)
        self._thread, self._begun_s, self.subject = thread, time.monotonic(), subject

    def _run(self, subject: str, stop: threading.Event) -> None:
        try:
            self._closed = recorder.run(replace(self._settings, subject=subject), stop, self._ended)
        except Exception as error:
            log.exception("the recording of %s stopped", subject)
            self.failure = " ".join(str(error).split())[:300] or type(error).__name__

    def _ended(self, why: str) -> None:
        """Runs on the recorder's thread, which goes on counting what it lets go."""
        log.error("%s", why)
        self.failure = why

    async def _keep_aside(self, path: Path, subject: str, language: str) -> None:
        """Keep the session of a recording that stopped by itself while the next one runs."""
        try:
            await asyncio.to_thread(keeping.apart, keeping.keep, path, subject, language)
        except Exception as error:
            log.warning("%s is not among the sessions: %s; add it with brachium sessions", path, error)
        self._history = None, []

    async def _look(self, subject: str) -> None:
        try:
            found = await asyncio.to_thread(keeping.earlier, self.folder, subject)
        except Exception as error:
            log.warning("earlier sessions of %s cannot be read: %s", subject, error)
            return
        if self._history[0] == subject:
            self._history = subject, found

    def _later(self, work: Any) -> None:
        task = asyncio.get_running_loop().create_task(work)
        self._looking.add(task)
        task.add_done_callback(self._looking.discard)
