"""Print the elbow of everyone in a room: python docs/examples/monitor.py [ROOM] [ENDPOINT]."""

import sys
from math import degrees

import brachium

where = dict(zip(("room", "endpoint"), sys.argv[1:], strict=False))
for key, skeleton in brachium.skeletons(**where):
    if "elbow_flexion" in skeleton.angles:
        print(
            f"{key.subject} {skeleton.side} elbow {degrees(skeleton.angles['elbow_flexion']):6.1f} deg",
            flush=True,
        )
