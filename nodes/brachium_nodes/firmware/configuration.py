"""What a node is told about itself: one JSON file on its flash."""

import json
import os

FILE = "brachium.json"
_NEW = "brachium.new"
ASKED = "setup.now"  # a file that stands for: let me be told anew

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


def kept():
    """Return what the file holds, {} when there is none or it is none of ours."""
    try:
        with open(FILE) as file:
            said = json.load(file)
        return said if isinstance(said, dict) else {}
    except (OSError, ValueError):
        return {}


def load():
    """Return the configuration, what is left out filled in. Raises OSError or ValueError."""
    with open(FILE) as file:
        return checked(json.load(file))


def save(said):
    """Keep this configuration; a loss of power leaves the old or the new one. Raises ValueError, OSError."""
    checked(said)
    with open(_NEW, "w") as file:
        json.dump(said, file)
    os.rename(_NEW, FILE)


def why_not():
    """Return why this node must be told something first, or nothing; asked is asked once."""
    try:
        os.remove(ASKED)
        return "as you wish"
    except OSError:
        pass
    try:
        load()
    except OSError:
        return "there is no %s yet" % FILE
    except ValueError as error:
        return str(error) or "%s is no JSON" % FILE
    return ""


def checked(said):
    """Return a configuration, what is left out filled in. Raises ValueError."""
    if not isinstance(said, dict):
        raise ValueError(FILE + " must hold one JSON object")
    chosen = _merged(DEFAULTS, said, "")
    for name in ("id", "token"):
        _is_word(name, chosen[name])
    if not _is_name(chosen["id"]):
        raise ValueError("%s: 'id' takes letters, digits, _, - and ., at most 64" % FILE)
    if chosen["gateway"]:
        _is_word("gateway", chosen["gateway"])
        if not chosen["gateway"].startswith("ws://") or " " in chosen["gateway"]:
            raise ValueError("%s: 'gateway' is ws://address:port/node, or empty" % FILE)
    wifi = chosen["wifi"]
    if len(wifi["name"].encode()) > 32 or 0 < len(wifi["password"]) < 8 or len(wifi["password"]) > 63:
        raise ValueError(FILE + ": a Wi-Fi's name has at most 32 bytes, its password 8 to 63 letters")
    if not 1 <= chosen["rate_hz"] <= 200 or not 1 <= chosen["batch"] <= 32:
        raise ValueError(FILE + ": rate_hz takes 1 to 200, batch 1 to 32")
    if not chosen["rate_hz"] * chosen["poll_ms"] <= 16000:
        raise ValueError(FILE + ": at most 16 samples may gather between two polls")
    return chosen


def _is_word(name, text):
    """Refuse what would break a line of the WebSocket's handshake, as no ASCII or a line's end would."""
    if not text:
        raise ValueError("%s: %r is missing" % (FILE, name))
    if len(text) > 128 or not all(" " <= letter <= "~" for letter in text):
        raise ValueError("%s: %r takes at most 128 plain letters" % (FILE, name))


def _is_name(text):
    others = text.replace("_", "").replace("-", "").replace(".", "")
    plain = all(letter.isdigit() or letter.isalpha() for letter in others)
    return plain and len(text) <= 64 and text[0] != "."


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
        elif not isinstance(value, str if isinstance(usual, str) else (int, float, bool)):
            raise ValueError("%s: %r cannot be %r" % (FILE, where + name, value))
        chosen[name] = value
    return chosen
