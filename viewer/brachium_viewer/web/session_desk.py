"""A session as the page keeps it: its recording, what is stored of it, and its report."""

import asyncio
import logging
import re
import threading
import time
from pathlib import Path
from typing import Any

from brachium_viewer import recorder
from brachium_wire import keys
from brachium_wire.bus import Bus
from brachium_wire.messages import Session

log = logging.getLogger(__name__)

Json = dict[str, Any]

READY_S = 10.0
LOOK_S = 0.05
CLOSE_S = 20.0


class NoRecording(ValueError):
    """The recording did not begin: one line that says why."""


class SessionDesk:
    """One session at a time; its recorder runs in a thread of its own."""

    def __init__(self, folder: Path, endpoint: str, room: str, service_id: str) -> None:
        self.folder = folder
        self._settings = recorder.RecordSettings(
            endpoint=endpoint, room=room, folder=folder, id=f"{service_id}-session"
        )
        self._stop = threading.Event()
        self._thread: threading.Thread | None = None
        self._report: recorder.RecordReport | None = None
        self._begun_s = 0.0
        self._beginning = asyncio.Lock()
        self.subject: str | None = None
        """Whose session is recorded."""
        self.failure = ""
        """Why recording stopped; empty while it goes on."""

    async def begin(self, bus: Bus, subject: str) -> None:
        """Record from now on, if not yet. Raises NoRecording."""
        async with self._beginning:
            if self._thread is not None:
                return
            await asyncio.to_thread(self._start, bus, subject)

    async def finish(self, subject: str, body: Session | None, origin: str) -> Json:
        """Close the recording and return where its report is. Raises NoRecording when there was none."""
        del body, origin
        if self._thread is None:
            raise NoRecording("nothing was recorded yet: start an exercise first")
        await asyncio.to_thread(self.close)
        if self._report is None:
            raise NoRecording(self.failure or "the recording could not be closed")
        return {"recording": self._report.path.name, "subject": subject}

    def state(self, subject: str | None) -> Json:
        """Return what a page shows of the recording, of alarms and of what was before."""
        del subject
        alarms = [{"what": "recording", "reason": self.failure}] if self.failure else []
        return {"recording": self._recording(), "alarms": alarms, "history": []}

    def report_file(self, name: str) -> Path | None:
        """Return the page of a session's report; None for one that is not there."""
        if not re.fullmatch(r"[A-Za-z0-9_.-]{1,120}", name):
            return None
        path = self.folder / f"{name}.html"
        return path if path.is_file() else None

    def _recording(self) -> Json:
        if self.failure:
            return {"state": "failed", "seconds": None}
        if self._thread is None:
            return {"state": "off", "seconds": None}
        return {"state": "on", "seconds": round(time.monotonic() - self._begun_s)}

    def close(self) -> None:
        """End the recorder, if it runs."""
        thread, self._thread = self._thread, None
        self._stop.set()
        self.subject = None
        if thread is not None:
            thread.join(CLOSE_S)

    def _start(self, bus: Bus, subject: str) -> None:
        self._stop, self.failure, self._report = threading.Event(), "", None
        thread = threading.Thread(target=self._run, args=(subject, self._stop), name="recorder")
        thread.start()
        token = keys.services(self._settings.room, f"recorder/{self._settings.id}/alive")
        deadline = time.monotonic() + READY_S
        while not bus.alive(token):  # until then, what is put is not recorded
            if not thread.is_alive() or time.monotonic() > deadline:
                self._stop.set()
                raise NoRecording(self.failure or f"the recorder did not start within {READY_S:.0f} s")
            time.sleep(LOOK_S)
        self._thread, self._begun_s, self.subject = thread, time.monotonic(), subject

    def _run(self, subject: str, stop: threading.Event) -> None:
        from dataclasses import replace

        try:
            self._report = recorder.run(replace(self._settings, subject=subject), stop)
        except Exception as error:
            log.exception("the recording of %s stopped", subject)
            self.failure = " ".join(str(error).split())[:300] or type(error).__name__
