"""Services as child processes: started, watched, started again after a while, ended together."""

import logging
import os
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from types import TracebackType
from typing import Self

from brachium.shell import PARENT

log = logging.getLogger(__name__)

END_S = 4.0
"""A service promises to end within 2 s; one that has not after this is killed."""
FIRST_PAUSE_S = 0.5
LONGEST_PAUSE_S = 30.0
STEADY_S = 60.0
"""A service that ran this long is taken to be well again: its next restart waits the first pause only."""


@dataclass(slots=True)
class Child:
    """One service's process, over all its restarts."""

    name: str
    words: list[str]
    """The command line after `brachium`."""
    stdout: Path | None = None
    stderr: Path | None = None
    process: subprocess.Popen[bytes] | None = None
    starts: int = 0
    started_s: float = 0.0
    due_s: float = 0.0
    pause_s: float = FIRST_PAUSE_S
    came_up: bool = False
    """Whoever started it has seen it at work."""

    def alive(self) -> bool:
        """Return whether it runs now."""
        return self.process is not None and self.process.poll() is None

    def complaint(self) -> str:
        """Return the last line it said on stderr, if that was kept."""
        if self.stderr is None or not self.stderr.exists():
            return ""
        lines = self.stderr.read_text("utf-8", "replace").strip().splitlines()
        return lines[-1] if lines else ""


@dataclass(slots=True)
class Processes:
    """The children, in the order of their start; they are ended in the opposite order."""

    environment: dict[str, str] = field(default_factory=dict)
    children: dict[str, Child] = field(default_factory=dict)
    command: tuple[str, ...] = (sys.executable, "-m", "brachium")
    clock: Callable[[], float] = time.monotonic

    def start(
        self, name: str, words: list[str], *, stdout: Path | None = None, stderr: Path | None = None
    ) -> Child:
        """Start one service."""
        child = self.children[name] = Child(name, words, stdout, stderr)
        self._spawn(child)
        return child

    def ended(self) -> list[Child]:
        """Return the children that do not run now."""
        return [child for child in self.children.values() if not child.alive()]

    def hopeless(self) -> Child | None:
        """Return a child that ended and that starting again would not help, or None.

        It refused its input (exit 2), or ended by itself before it ever came up.
        """
        for child in self.ended():
            code = child.process.returncode if child.process is not None else None
            if code == 2 or (code is not None and code >= 0 and not child.came_up):
                return child
        return None

    def revive(self) -> list[Child]:
        """Start again what ended, each after its pause; return those started now."""
        now, revived = self.clock(), []
        for child in self.ended():
            if child.due_s == 0.0:
                if now - child.started_s >= STEADY_S:
                    child.pause_s = FIRST_PAUSE_S
                child.due_s = now + child.pause_s
                code = child.process.returncode if child.process is not None else None
                log.warning("%s ended (exit %s); again in %.1f s", child.name, code, child.pause_s)
            elif now >= child.due_s:
                child.pause_s = min(2.0 * child.pause_s, LONGEST_PAUSE_S)
                self._spawn(child)
                revived.append(child)
        return revived

    def end(self, name: str) -> int:
        """End one service and return its exit code."""
        child = self.children.pop(name)
        process = child.process
        assert process is not None
        if process.poll() is None:
            process.terminate()
        return _wait(child, process)

    def close(self) -> None:
        """End every service, the last one started first."""
        for name in reversed(list(self.children)):
            self.end(name)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _spawn(self, child: Child) -> None:
        with ExitStack() as files:
            out, err = (
                files.enter_context(p.open("ab")) if p else None for p in (child.stdout, child.stderr)
            )
            # A session of its own: Ctrl-C reaches only us, and we end the services in order.
            child.process = subprocess.Popen(
                [*self.command, *child.words],
                stdin=subprocess.DEVNULL,
                stdout=out,
                stderr=err,
                env={**os.environ, **self.environment, PARENT: str(os.getpid())},
                start_new_session=True,
            )
        child.starts += 1
        child.started_s, child.due_s = self.clock(), 0.0


def _wait(child: Child, process: subprocess.Popen[bytes]) -> int:
    try:
        return process.wait(END_S)
    except subprocess.TimeoutExpired:
        log.warning("%s did not end within %.0f s and is killed", child.name, END_S)
        process.kill()
        return process.wait()
