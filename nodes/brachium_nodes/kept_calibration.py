"""A sensor's calibration as it travels to a node and is kept there: the JSON text of its fields. Pure.

A node stores the text as it is and needs no decoder for it. What it brings in its next hello is compared
with a tolerance, for its numbers may have fewer digits than ours.
"""

import json
from typing import Any

import msgspec

from brachium_nodes.node_frames import Keep
from brachium_wire.codec import Drop, WireError
from brachium_wire.messages import SensorCalibration
from brachium_wire.sensor_records import Keeper

LONGEST_TEXT = 800
"""Characters: 18 numbers of at most 13, with their names. A node's whole frame has at most 1024 bytes."""
ALIKE, ALIKE_SMALL = 1e-5, 1e-7
"""Numbers that differ by less than this share, or by this, are one number said by two programs."""


def text_of(calibration: SensorCalibration) -> str:
    """Return the text, with as many digits as float32 has."""

    def short(value: Any) -> Any:
        return [short(v) for v in value] if isinstance(value, list | tuple) else float(f"{value:.8g}")

    fields: dict[str, Any] = msgspec.to_builtins(calibration)
    return json.dumps({name: short(value) for name, value in fields.items()}, separators=(",", ":"))


def calibration_of(text: str) -> SensorCalibration:
    """Return the calibration of a text, or raise WireError."""
    try:
        return msgspec.json.decode(text, type=SensorCalibration)
    except msgspec.MsgspecError as error:
        raise WireError(Drop.WRONG_TYPE, f"keep/1: no calibration: {error}") from None


def alike(one: SensorCalibration, other: SensorCalibration) -> bool:
    """Return whether two calibrations are the same but for the last digits."""
    return all(
        _alike(getattr(one, name), getattr(other, name)) for name in SensorCalibration.__struct_fields__
    )


def _alike(a: Any, b: Any) -> bool:
    if a is None or b is None:
        return a is b
    if isinstance(a, tuple):
        return len(a) == len(b) and all(_alike(x, y) for x, y in zip(a, b, strict=True))
    return bool(abs(a - b) <= ALIKE * abs(a) + ALIKE_SMALL)


class Keeping:
    """Which calibration holds for a connected node, and who keeps it: `own` is what its hello brought."""

    def __init__(self, own: SensorCalibration, known: SensorCalibration) -> None:
        self._own, self.calibration = own, known

    @property
    def keeper(self) -> Keeper:
        """Who keeps it."""
        if self.calibration == SensorCalibration():
            return ""
        return "node" if alike(self._own, self.calibration) else "gateway"

    def frame(self) -> Keep | None:
        """Return what the node is to be told; None when it knows."""
        return Keep(calibration=text_of(self.calibration)) if self.keeper == "gateway" else None

    def kept(self) -> None:
        """Take that the node has stored what it was told."""
        self._own = self.calibration
