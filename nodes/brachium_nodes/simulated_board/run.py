"""Runs a node's firmware on this host, in the node's folder: micropython run.py BOARD FIRMWARE."""

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

machine.SoftI2C(None, None, None)
gc.collect()
board.COUNTS["heap_board"] = gc.mem_alloc() - before

try:
    import main
finally:
    board.report()
