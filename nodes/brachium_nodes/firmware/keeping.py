"""The sensor's calibration on the node's flash. Loaded when there is one, given back: memory is short."""

import json
import os

FILE = "calibration.json"


def calibration():
    """Return the calibration that is kept on the node, {} when there is none or it cannot be read."""
    try:
        with open(FILE) as file:
            kept = json.load(file)
        return {name: values for name, values in kept.items() if isinstance(values, list)}
    except (OSError, ValueError, AttributeError):
        return {}


def keep(text):
    """Store the JSON text of a calibration, whole or not at all; return whether it is stored."""
    try:
        with open("calibration.new", "w") as file:
            file.write(text)
        os.rename("calibration.new", FILE)
        return True
    except (OSError, TypeError) as error:  # a full flash must not end the connection: it would come again
        print("calibration not kept:", error)
        return False
