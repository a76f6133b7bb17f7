"""Rerun's viewer in a process of its own, on loopback: a window, or the server that browsers read from."""

import importlib.util
import os
import shutil
import socket
import subprocess
import tempfile
import threading
import time
from pathlib import Path
from types import TracebackType
from typing import Self

LOOPBACK = "127.0.0.1"
START_S = 20.0
"""A cold start reads 280 MB from disk."""
END_S = 0.7


class ViewError(RuntimeError):
    """The live view cannot start, or its viewer has ended; the text says what to do."""


def free_port(port: int, what: str) -> int:
    """Return `port` if nobody listens on it, or any free one for 0; raise ViewError naming it otherwise."""
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((LOOPBACK, port))
        except OSError as error:
            raise ViewError(
                f"port {port}, wanted for {what}, cannot be had ({error.strerror}): "
                "stop the program that has it, or choose another port"
            ) from None
        return int(probe.getsockname()[1])


def viewer_program() -> Path:
    """Return the viewer that comes with rerun-sdk, or raise ViewError naming the extra that is missing."""
    package = importlib.util.find_spec("rerun_cli")
    if package is None or package.origin is None:
        raise ViewError("the live view needs Rerun: pip install 'brachium[view]'")
    folder = Path(package.origin).parent
    names = ("rerun", "rerun.exe", "Rerun.app/Contents/MacOS/Rerun")
    found = [folder / name for name in names if (folder / name).is_file()]
    if not found:
        raise ViewError(f"rerun-sdk is installed without its viewer (looked in {folder}): install it again")
    return found[0]


class ViewerProcess:
    """The viewer and its end. With `web_files_port` it has no window but serves the page's files."""

    def __init__(self, *, grpc_port: int, memory_limit: str, web_files_port: int | None = None) -> None:
        self.url = f"rerun+http://{LOOPBACK}:{grpc_port}/proxy"
        self._ports = [grpc_port] if web_files_port is None else [grpc_port, web_files_port]
        program = str(viewer_program())
        self._folder = Path(tempfile.mkdtemp(prefix="brachium-view-"))
        self._said = self._folder / "said.txt"
        # A configuration of its own, with statistics switched off: the user's is neither read nor changed.
        environment = os.environ | {"XDG_CONFIG_HOME": str(self._folder), "RUST_LOG": "warn"}
        command = [
            program,
            "--bind",
            LOOPBACK,
            "--port",
            str(grpc_port),
            "--server-memory-limit",
            memory_limit,
        ]
        if web_files_port is None:
            command += ["--memory-limit", memory_limit, "--hide-welcome-screen", "--expect-data-soon"]
        else:
            command += ["--serve-web", "--web-viewer-port", str(web_files_port)]
        off = [program, "analytics", "disable"]
        subprocess.run(off, env=environment, capture_output=True, timeout=START_S, check=False)
        with self._said.open("wb") as said:
            # In a session of its own, so that Ctrl-C is ours to pass on.
            self._process = subprocess.Popen(
                command,
                env=environment,
                stdin=subprocess.DEVNULL,
                stdout=said,
                stderr=said,
                start_new_session=True,
            )

    @property
    def pid(self) -> int:
        """The viewer's process."""
        return self._process.pid

    def wait_ready(self, stop: threading.Event) -> None:
        """Return when its ports answer or `stop` is set; raise ViewError if it ends or START_S pass."""
        deadline = time.monotonic() + START_S
        while not stop.is_set() and not all(map(_answers, self._ports)):
            if not self.running():
                raise ViewError(f"the viewer ended with code {self._process.returncode}: {self.last_words()}")
            if time.monotonic() > deadline:
                raise ViewError(f"the viewer did not start within {START_S:g} s: {self.last_words()}")
            stop.wait(0.05)

    def running(self) -> bool:
        """Return whether the viewer is there; a person may have closed its window."""
        return self._process.poll() is None

    @property
    def code(self) -> int | None:
        """The exit code; None while it runs."""
        return self._process.poll()

    def last_words(self) -> str:
        """Return the last line that the viewer wrote."""
        lines = self._said.read_text(errors="replace").strip().splitlines() if self._said.exists() else []
        return lines[-1][-300:] if lines else "it said nothing"

    def close(self) -> None:
        """End the viewer; one that is frozen is killed."""
        for end in (self._process.terminate, self._process.kill):
            end()
            try:
                self._process.wait(END_S)
                break
            except subprocess.TimeoutExpired:
                continue
        shutil.rmtree(self._folder, ignore_errors=True)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def _answers(port: int) -> bool:
    try:
        socket.create_connection((LOOPBACK, port), timeout=0.2).close()
    except OSError:
        return False
    return True
