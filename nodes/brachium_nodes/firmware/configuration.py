"""What a node is told about itself: one JSON file on its flash."""

import json

FILE = "brachium.json"

DEFAULTS = {
    "id": "",
    "token": "",
    "gateway": "",  # ws://host:port/node; empty: ask the network
    "wifi": {"name": "", "password": ""},
    "origin": "worn",
    "rate_hz": 50,
    "batch": 5,
    "poll_ms": 40,
    "queue_s": 1,
    "longest_pause_s": 30,
    "discovery": {"address": "255.255.255.255", "port": 8766},
    "i2c": {"id": -1, "scl": 5, "sda": 4, "hz": 400000},  # id -1: bit-banged, as an ESP8266 must
    "battery": {
        "pin": -1,  # of the converter; -1: none is wired. The ESP8266's only one is 0
        "full_scale_v": 5.0,  # at the battery, when the converter reads its highest
        "capacity_mah": 700,
        "current_ma": 80,
        "empty_v": 3.3,
    },
    "watchdog": True,
}


def load():
    """Return the configuration, what is left out filled in. Raises OSError or ValueError."""
    with open(FILE) as file:
        said = json.load(file)
    if not isinstance(said, dict):
        raise ValueError(FILE + " must hold one JSON object")
    chosen = _merged(DEFAULTS, said, "")
    for name in ("id", "token"):
        if not chosen[name]:
            raise ValueError("%s: %r is missing" % (FILE, name))
    if not 1 <= chosen["rate_hz"] <= 200 or not 1 <= chosen["batch"] <= 32:
        raise ValueError(FILE + ": rate_hz takes 1 to 200, batch 1 to 32")
    if not chosen["rate_hz"] * chosen["poll_ms"] <= 16000:
        raise ValueError(FILE + ": at most 16 samples may gather between two polls")
    return chosen


def _merged(defaults, said, where):
    chosen = {}
    for name in said:
        if name not in defaults:
            raise ValueError("%s: %r is not known" % (FILE, where + name))
    for name, usual in defaults.items():
        value = said.get(name, usual)
        if isinstance(usual, dict):
            if not isinstance(value, dict):
                raise ValueError("%s: %r must be an object" % (FILE, name))
            value = _merged(usual, value, name + ".")
        elif isinstance(usual, str) != isinstance(value, str):
            raise ValueError("%s: %r cannot be %r" % (FILE, where + name, value))
        chosen[name] = value
    return chosen
