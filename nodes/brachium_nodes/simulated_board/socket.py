"""Sockets with as little memory for sending as a small chip's have; port 80 is where the host lets it be."""

import board
import usocket

_SOL_SOCKET, _SO_SNDBUF = 1, 7


def __getattr__(name):
    return getattr(usocket, name)


def getaddrinfo(host, port, *more):
    """Return where that is."""
    return usocket.getaddrinfo(host, board.WEB_PORT if port == 80 and board.WEB_PORT else port, *more)


def socket(*kind):
    """Return a socket."""
    made = usocket.socket(*kind)
    made.setsockopt(_SOL_SOCKET, _SO_SNDBUF, board.SEND_BUFFER)
    return made
