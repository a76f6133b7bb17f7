"""What an emulated node says of its battery and its radio; seeded, and pure in the time."""

from dataclasses import dataclass
from math import floor

from brachium_nodes.node_frames import NodeStatus
from brachium_nodes.sensors import generator

FULL_V = (3.95, 4.15)
"""A lithium cell that was charged today."""
FALL_V_PER_S = (0.06 / 3600.0, 0.10 / 3600.0)
"""An ESP8266 that sends empties a small cell in some eight hours."""
EMPTY_V = 3.3
"""Here the node's own protection switches off."""
SIGNAL_DBM = (-66.0, -50.0)
"""A person in the room of the access point."""
FADING_DBM = 2.5
"""Standard deviation from second to second, as the body turns and shades."""


@dataclass(frozen=True, slots=True)
class EmulatedPower:
    """One node's battery and radio."""

    seed: int
    segment: str
    full_v: float
    fall_v_per_s: float
    signal_dbm: float

    @classmethod
    def draw(cls, seed: int, segment: str) -> "EmulatedPower":
        """Return the battery and radio that this seed gives to this segment's node."""
        random = generator(seed, segment, "power")
        full_v, fall, signal = (float(random.uniform(*ends)) for ends in (FULL_V, FALL_V_PER_S, SIGNAL_DBM))
        return cls(seed, segment, full_v, fall, signal)

    def status(self, time_s: float) -> NodeStatus:
        """Return what the node says at true time `time_s`, to a mV and a dBm, as such nodes do."""
        fading = generator(self.seed, self.segment, "fading", max(0, floor(time_s))).standard_normal()
        volts = max(self.full_v - self.fall_v_per_s * time_s, EMPTY_V)
        return NodeStatus(
            battery_v=round(volts, 3),
            battery_hours=round((volts - EMPTY_V) / self.fall_v_per_s / 3600.0, 2),
            rssi_dbm=float(round(self.signal_dbm + FADING_DBM * fading)),
        )
