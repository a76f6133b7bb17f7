"""Runs a node's firmware on this host, in the node's folder; the board starts it.

micropython run.py BOARD FIRMWARE LINE PPM SHIFT SEND_BUFFER WEB_PORT
"""

import sys

sys.path.insert(0, sys.argv[1])
sys.path.insert(1, sys.argv[2])

import gc

gc.collect()
before = gc.mem_alloc()

import board
import machine
import network
import socket
import time

gc.collect()
board.HEAP[1] = gc.mem_alloc() - before

try:
    import main
except KeyboardInterrupt:
    pass  # a chip would be at its prompt now
finally:
    board.tell_heap()
