"""A node that must be told about itself: over the serial line, or by one page in a Wi-Fi of its own.

Loaded instead of everything else, and ended by a restart: then all of the memory is the node's again. No
watchdog runs meanwhile, so that files can be copied at leisure.
"""

import asyncio
import binascii
import json
import os
import time

import configuration
import machine
import network
from serial_line import SerialLine
from web_form import WebForm

_LOOK_MS = 100
_PATIENCE_MS = 600_000  # a node that could work goes back to work
_LETTERS = "abcdefghjkmnpqrstuvwxyz123456789"
_WPA2 = 3


def run(why):
    """Serve until somebody said what is needed, or nobody does and it was not needed; then start anew."""
    name, password = _name(), "".join(_LETTERS[byte % 32] for byte in os.urandom(10))
    network.WLAN(network.STA_IF).active(False)
    point = network.WLAN(network.AP_IF)
    point.active(True)
    point.config(ssid=name, key=password, security=_WPA2)
    print("setup:", why)
    print("setup: join the Wi-Fi %s with the password %s and open http://192.168.4.1/" % (name, password))
    print("setup: or send brachium.json here, as one line")
    asyncio.run(_serve())
    time.sleep_ms(500)  # the last answer goes out
    machine.reset()


def _name():
    said = configuration.kept().get("id")
    own = binascii.hexlify(machine.unique_id()).decode()[-6:]
    return "brachium-" + (said if isinstance(said, str) and said else own)[:20]


async def _serve():
    form, line = WebForm(), SerialLine()
    server = await asyncio.start_server(form.serve, "0.0.0.0", 80, backlog=2)
    began = time.ticks_ms()
    while not form.saved:
        await asyncio.sleep_ms(_LOOK_MS)
        text = line.line()
        if text is not None:
            form.saved = _take(text)
        if time.ticks_diff(time.ticks_ms(), began) > _PATIENCE_MS and not configuration.why_not():
            break
    server.close()


def _take(text):
    """Take a line; return whether that was it."""
    if text == "setup":
        print("setup: send brachium.json here, as one line")
        return False
    try:
        configuration.save(json.loads(text))
    except (ValueError, OSError) as error:
        print("refused:", str(error) or "no JSON object on one line")
        return False
    print("ok: starting anew")
    return True
