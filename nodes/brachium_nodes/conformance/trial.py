"""The node under trial: its command, its process, and how long it is waited for."""

import contextlib
import os
import shlex
import signal
import subprocess
import time
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path

from brachium_nodes.conformance.heard import Heard

VARIABLES = {
    "host": "BRACHIUM_NODE_HOST",
    "port": "BRACHIUM_NODE_PORT",
    "id": "BRACHIUM_NODE_ID",
    "token": "BRACHIUM_NODE_TOKEN",
}
"""What `{host}` and its like in the command's words stand for is in these, too."""
END_S = 5.0


@dataclass(frozen=True, kw_only=True)
class Patience:
    """How long things may take, s."""

    listen_s: float = 10.0
    """Undisturbed."""
    outage_s: float = 5.0
    """The door is shut: longer than a node keeps samples."""
    start_s: float = 20.0
    """From its command to its first call."""
    return_s: float = 50.0
    """From a broken connection to the next call: the longest pause, with some chance in it."""
    silence_s: float = 65.0
    """From the last word of a gateway to the node's next call."""
    bye_s: float = 5.0


QUICK = Patience(listen_s=3.5, outage_s=3.0, start_s=10.0, return_s=8.0, silence_s=8.0, bye_s=2.0)
"""For a node that is known to be quick."""


@dataclass(kw_only=True)
class Trial:
    """One command, started as often as it must be. Use it in a `with` block: what it started is ended."""

    command: tuple[str, ...]
    node: str
    token: str
    port: int = 0
    patience: Patience = field(default_factory=Patience)
    log: Path | None = None
    """What the node says on its output goes here."""
    quiet: Heard = field(default_factory=Heard)
    """What was heard undisturbed."""
    starts: int = 0
    _process: "subprocess.Popen[bytes] | None" = None

    def words(self) -> list[str]:
        """Return the command with what its placeholders stand for."""
        named = self._named()
        words = []
        for word in self.command:
            for name, value in named.items():
                word = word.replace("{" + name + "}", value)
            words.append(word)
        return words

    def _named(self) -> Mapping[str, str]:
        return {"host": "127.0.0.1", "port": str(self.port), "id": self.node, "token": self.token}

    def start(self) -> None:
        """Start the command, after ending what ran before. Raises ValueError when there is none such."""
        self.stop()
        self.starts += 1
        # A signal cuts short what the main thread does: not between the command's start and its being known.
        with ThreadPoolExecutor(1) as apart:
            apart.submit(self._begin).result()

    def _begin(self) -> None:
        environment = {**os.environ, **{VARIABLES[name]: value for name, value in self._named().items()}}
        with (self.log or Path(os.devnull)).open("ab") as said:
            try:
                self._process = subprocess.Popen(
                    self.words(),
                    stdin=subprocess.DEVNULL,
                    stdout=said,
                    stderr=said,
                    env=environment,
                    start_new_session=True,
                )
            except OSError as error:
                raise ValueError(f"{shlex.join(self.words())} cannot be started: {error}") from None

    def ended(self) -> bool:
        """Return whether the command has ended by itself."""
        return self._process is not None and self._process.poll() is not None

    def end_told(self) -> str:
        """Return how the command ended by itself and where its words are, to be put behind a verdict."""
        if self._process is None or self._process.poll() is None:
            return ""
        return f"; the command ended with {self._process.returncode}, --log FILE keeps what it says"

    def wait(self, seconds: float) -> None:
        """Let time pass."""
        time.sleep(seconds)

    def terminate(self) -> None:
        """Switch it off, politely."""
        self._signal(signal.SIGTERM)

    def stop(self) -> None:
        """End it, whatever it does."""
        if self._process is None:
            return
        self._signal(signal.SIGTERM)
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.wait(END_S)
        self._signal(signal.SIGKILL)
        self._process.wait()
        self._process = None

    def _signal(self, number: signal.Signals) -> None:
        """Signal the command and all that it started: its session is its own."""
        if self._process is not None:
            try:
                os.killpg(self._process.pid, number)
            except ProcessLookupError:
                return
