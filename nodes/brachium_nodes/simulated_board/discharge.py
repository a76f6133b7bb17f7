"""A cell that empties, as the firmware sees it, quicker than it does: micropython discharge.py FIRMWARE.

`discharge.json` names a file of the converter's readings, 2 bytes each, one a second. Says after how many
seconds only `low_h` hours were left by the firmware's reckoning, and after how many the cell was
empty; null: never.
"""

import json
import sys

sys.path.insert(0, sys.argv[1])

from battery import Battery


class Converter:
    """Reads one after the other."""

    def __init__(self, path):
        self._file = open(path, "rb")
        self._two = bytearray(2)

    def read_u16(self):
        """Return the next reading."""
        self._file.readinto(self._two)
        return self._two[0] | self._two[1] << 8


def run(case):
    """Return when the hours first were down to `low_h`, and when the cell was empty."""
    battery = Battery(Converter(case["readings"]), case["battery"])
    seconds, warned = 0, None
    while not battery.empty() and seconds < case["seconds"]:
        battery.measure()
        seconds += 1
        if warned is None and battery.hours <= case["low_h"]:
            warned = seconds
    return [warned, seconds if battery.empty() else None]


with open("discharge.json") as file:
    print(json.dumps(run(json.load(file))))
