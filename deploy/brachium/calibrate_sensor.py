"""`brachium calibrate --sensor`: asks fusion, shows how far it is, waits until somebody keeps the result."""

import sys
import threading
import time
from typing import Any

import msgspec

from brachium import sensor_picture
from brachium.asking import asked
from brachium.shell import Failed, print_json
from brachium_fusion import sensor_guide
from brachium_wire import keys
from brachium_wire.bus import Bus, Inbox
from brachium_wire.codec import WireError, decode_topic
from brachium_wire.messages import Answer, Calibration, Info
from brachium_wire.sensor_records import SensorProgress

LONGEST_S = sensor_guide.LONGEST_S + 60.0
"""Fusion ends by itself before."""
KEPT_WITHIN_S = 5.0
"""A node that keeps calibrations has said so long before."""
LOOK_S = 0.1


class SensorCalibrationRun:
    """One sensor's calibration on a bus."""

    def __init__(self, bus: Bus, room: str, subject: str, segment: str, stop: threading.Event) -> None:
        self._bus, self._stop, self._segment = bus, stop, segment
        self._command = keys.command(room, subject, "calibrate")
        self._news: Inbox = bus.subscribe(keys.calibration(room, subject))
        self._infos: Inbox = bus.subscribe(keys.info(room, subject, segment))

    def run(self, steps: list[str] | None, *, as_json: bool) -> int:
        """Do it. 0 when no step was refused; raises Failed with the reason."""
        arguments: dict[str, Any] = {"sensor": self._segment}
        if steps is not None:
            arguments["steps"] = steps
        answer = self._asked(arguments, _Screen(quiet=as_json))
        if answer is None:
            if self._stop.is_set():
                return 1
            raise Failed("fusion does not answer; is `brachium fuse` running in this room?")
        data = answer.data
        kept = self._kept(data) if data.get("calibration") else ""
        if as_json:
            print_json({"ok": answer.ok, "reason": answer.reason, **data, "kept": kept})
        else:
            for text in sensor_picture.found(data, kept):
                print(text, flush=True)
        if not answer.ok:
            raise Failed(answer.reason)
        return 0

    def _asked(self, arguments: dict[str, Any], screen: "_Screen") -> Answer | None:
        """Ask, and show progress until the answer comes."""

        def show(news: Calibration) -> None:
            progress = news.sensor
            if progress is not None and progress.segment == self._segment:
                screen.show(progress)

        answer = asked(self._bus, self._command, arguments, self._news, show, self._stop, LONGEST_S)
        screen.end()
        return answer

    def _kept(self, data: dict[str, Any]) -> str:
        """Return who keeps what was found: the node, its gateway, or nobody that said so in time."""
        deadline, kept = time.monotonic() + KEPT_WITHIN_S, ""
        while kept != "node" and time.monotonic() < deadline and not self._stop.is_set():
            for key, payload in self._infos.drain():
                try:
                    info = decode_topic(payload, keys.parse(key).topic)
                except WireError:
                    continue
                if isinstance(info, Info) and info.node == data["node"]:
                    kept = info.kept
            self._infos.wait(LOOK_S)
        return kept


class _Screen:
    """A picture that is drawn over and over on a terminal; elsewhere a line whenever there is news."""

    def __init__(self, *, quiet: bool) -> None:
        self._quiet, self._terminal = quiet, sys.stdout.isatty()
        self._drawn, self._said = 0, ""
        self._at, self._covered = ("", 0), 0.0

    def show(self, progress: SensorProgress) -> None:
        """Show how far it is."""
        if self._quiet or progress.state != "running":
            return
        if not self._terminal:
            if (progress.step, progress.attempt) != self._at:
                self._at, self._covered = (progress.step, progress.attempt), 0.0
                if progress.step in progress.refused:
                    print(f"{progress.step} refused: {progress.refused[progress.step]}", flush=True)
            # What is covered is guessed anew with every reading, and falls at times: no news for a line.
            self._covered = max(self._covered, progress.coverage)
            words = sensor_picture.line(msgspec.structs.replace(progress, coverage=self._covered))
            if words != self._said:
                print(words, flush=True)
            self._said = words
            return
        lines = sensor_picture.picture(progress)
        up = f"\x1b[{self._drawn}A" if self._drawn else ""
        sys.stdout.write(up + "".join(f"\x1b[2K{text}\n" for text in lines) + "\x1b[J")
        sys.stdout.flush()
        self._drawn = len(lines)

    def end(self) -> None:
        """Leave the last picture where it is."""
        self._drawn = 0
