"""Tells a node about itself over its serial line: `setup`, and then one line of JSON."""

import json
import os
import select
import time
from importlib import import_module
from pathlib import Path
from typing import Any

TIMEOUT_S = 40.0
"""A node that is just being refused its Wi-Fi hears it after that try only."""


class NotTold(RuntimeError):
    """The node did not take its configuration; the message says why."""


def open_serial(port: str) -> int:
    """Return a file descriptor of a serial line of 115200 baud, raw. Raises NotTold."""
    try:
        import termios
        import tty
    except ImportError:
        raise NotTold(
            "serial lines are spoken to on Linux and macOS; else copy the file with mpremote"
        ) from None
    try:
        line = os.open(port, os.O_RDWR | os.O_NOCTTY)
        tty.setraw(line)
        about = termios.tcgetattr(line)
        about[4] = about[5] = termios.B115200
        termios.tcsetattr(line, termios.TCSANOW, about)
    except (OSError, termios.error) as error:
        why = "is the board plugged in, and no other program at it?"
        raise NotTold(f"{port} cannot be used: {error}; {why}") from None
    return line


def tell(line: int, configuration: dict[str, Any], timeout_s: float = TIMEOUT_S) -> None:
    """Send a node its configuration over the serial line with this descriptor; it starts anew with it.

    Raises NotTold when it refuses or says nothing.
    """
    talk = _Talk(line, time.monotonic() + timeout_s)
    talk.say("\nsetup\n")
    talk.until("setup: or send brachium.json here", "setup: send brachium.json here")
    talk.say(json.dumps(configuration, ensure_ascii=True) + "\n")
    answer = talk.until("ok:", "refused:")
    if answer.startswith("refused:"):
        raise NotTold(f"the node refused it: {answer.removeprefix('refused:').strip()}")


def read_configuration(path: Path) -> dict[str, Any]:
    """Return a `brachium.json`, checked by the node's own rules. Raises NotTold."""
    try:
        said = json.loads(path.read_text("utf-8"))
    except (OSError, ValueError) as error:
        raise NotTold(f"{path} cannot be read as JSON: {error}") from None
    if not isinstance(said, dict):
        raise NotTold(f"{path} must hold one JSON object")
    rules = import_module("brachium_nodes.firmware.configuration")  # MicroPython: it has no types
    try:
        rules.checked(said)
    except ValueError as error:
        raise NotTold(f"the node would refuse {path}: {error}") from None
    return said


class _Talk:
    def __init__(self, line: int, deadline_s: float) -> None:
        self._line, self._deadline_s, self._heard = line, deadline_s, b""

    def say(self, text: str) -> None:
        data = text.encode()
        while data:
            # A chip takes what it has room for; its line has no way to say stop.
            sent = os.write(self._line, data[:64])
            data = data[sent:]
            time.sleep(0.01)

    def until(self, *wanted: str) -> str:
        while True:
            *lines, self._heard = self._heard.split(b"\n")
            for number, data in enumerate(lines):
                text = data.decode("utf-8", "replace").strip()
                if text.startswith(wanted):
                    self._heard = b"\n".join([*lines[number + 1 :], self._heard])
                    return text
            left = self._deadline_s - time.monotonic()
            if left <= 0 or not select.select([self._line], [], [], left)[0]:
                raise NotTold(
                    "the node says nothing on this line; look at cable and port, or press its reset"
                )
            self._heard += os.read(self._line, 4096)
