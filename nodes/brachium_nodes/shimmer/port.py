"""A serial port without a library: what Bluetooth's RFCOMM, a cable and a pseudo-terminal have in common."""

import os
import select
import termios
import tty
from types import TracebackType
from typing import Self

BAUD = termios.B115200
"""Of a cable; Bluetooth and pseudo-terminals do not care."""
WRITE_S = 1.0


class PortGone(ConnectionError):
    """The port cannot be opened, or went away; the text says which and why."""


class SerialPort:
    """An open port in raw mode."""

    def __init__(self, path: str) -> None:
        """Open `path`. Raises PortGone."""
        self.path = path
        try:
            self._file = os.open(path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        except OSError as error:
            raise PortGone(f"{path}: {error.strerror}") from None
        try:
            tty.setraw(self._file)
            settings = termios.tcgetattr(self._file)
            settings[4] = settings[5] = BAUD
            termios.tcsetattr(self._file, termios.TCSANOW, settings)
        except termios.error as error:
            os.close(self._file)
            raise PortGone(f"{path}: {error.args[-1]}; give a serial port, as /dev/rfcomm0") from None

    def read(self, timeout_s: float) -> bytes:
        """Return what is there, or came within `timeout_s`; b"" if nothing did. Raises PortGone."""
        try:
            if not select.select([self._file], [], [], timeout_s)[0]:
                return b""
            data = os.read(self._file, 4096)
        except BlockingIOError:
            return b""
        except OSError as error:
            raise PortGone(f"{self.path}: {error.strerror}") from None
        if not data:
            raise PortGone(f"{self.path}: the other side hung up")
        return data

    def write(self, data: bytes) -> None:
        """Send all of `data`. Raises PortGone."""
        try:
            while data:
                if not select.select([], [self._file], [], WRITE_S)[1]:
                    raise PortGone(f"{self.path}: takes nothing")
                data = data[os.write(self._file, data) :]
        except OSError as error:
            if isinstance(error, PortGone):
                raise
            raise PortGone(f"{self.path}: {error.strerror}") from None

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        os.close(self._file)


def is_pseudo(path: str) -> bool:
    """Return whether a program stands behind the port, and no device."""
    return os.path.realpath(path).startswith("/dev/pts/")
