"""Sockets with as little memory for what is to be sent as a small chip's have."""

import board
import usocket

_SOL_SOCKET, _SO_SNDBUF = 1, 7


def __getattr__(name):
    return getattr(usocket, name)


def socket(*kind):
    """Return a socket."""
    made = usocket.socket(*kind)
    made.setsockopt(_SOL_SOCKET, _SO_SNDBUF, board.SETTINGS["send_buffer"])
    return made
