"""The serial line, a line of text at a time and without waiting for one."""

import select
import sys

_LONGEST = 1500


class SerialLine:
    """Whoever types on the node's serial line."""

    def __init__(self):
        self._poll = select.poll()
        self._poll.register(sys.stdin, select.POLLIN)
        self._text = bytearray()

    def line(self):
        """Return a whole line, or None while there is none; what is too long is cut."""
        while self._poll is not None and self._poll.poll(0):
            letter = sys.stdin.read(1)
            if not letter:
                self._poll = None  # nobody can type any more
            elif letter in "\r\n":
                text, self._text = bytes(self._text), bytearray()
                if text:
                    return text.decode()
            elif len(self._text) < _LONGEST:
                self._text.extend(letter.encode())
        return None
