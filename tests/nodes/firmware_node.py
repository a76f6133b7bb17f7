"""Runs the wearables' firmware as one command, for whoever starts nodes by a command.

firmware_node.py FOLDER FIRMWARE BOARD PORT ID TOKEN
"""

import signal
import sys
import threading
import time
from pathlib import Path

from brachium_nodes.firmware_build import Build
from brachium_nodes.firmware_host import FirmwareNode, prepare
from brachium_nodes.wearer import Wearer, WearerSettings

folder, firmware, board, port, node, token = sys.argv[1:7]
stop = threading.Event()
signal.signal(signal.SIGTERM, lambda *_: stop.set())
wearer = Wearer(WearerSettings(rate_hz=50.0, mag_every=1, segments=("forearm_r",), level="ideal"))
prepare(
    Path(folder),
    node,
    token,
    wearer,
    "forearm_r",
    seconds=200.0,
    start_us=time.monotonic_ns() // 1000,
    gateway=f"ws://127.0.0.1:{port}/node",
    longest_pause_s=2,
)
running = FirmwareNode.start(Path(folder), Build(Path(firmware), Path(board)))
stop.wait()
running.stop()
