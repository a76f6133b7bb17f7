"""The files that say which frames are which sensor: a map, a sensor table, a CAN database. Read and typed."""

from functools import cache
from pathlib import Path
from typing import Any, Literal

import msgspec

from brachium_nodes.can.toml_records import BadMap
from brachium_wire.messages import Quaternion

SHIPPED = Path(__file__).parent / "maps"
Quantity = Literal["acceleration", "angular_rate", "field", "quaternion"]


class Signals(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Where one quantity stands: signals of one message, and what makes SI of them."""

    message: str
    signals: list[str]
    scale: float = 1.0
    """Times the DBC's physical value: m/s^2, rad/s, uT."""
    optional: bool = False
    """A sample counts without it."""
    inverse: bool = False
    """A quaternion is sensor from world."""


class KeySignal(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What numbers the samples."""

    signals: dict[str, str]
    """By message. Either every message with a quantity, or one that stands before them on the bus."""
    tick_s: float | None = None
    """A time: seconds a step. Left out: a counter of samples."""


class SensorMap(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One kind of sensor."""

    dbc: str
    chip: str
    rate_hz: float
    key: KeySignal | None = None
    acceleration: Signals | None = None
    angular_rate: Signals | None = None
    field: Signals | None = None
    quaternion: Signals | None = None

    def quantities(self) -> dict[Quantity, Signals]:
        """Return what it measures."""
        found: dict[Quantity, Signals | None] = {
            "acceleration": self.acceleration,
            "angular_rate": self.angular_rate,
            "field": self.field,
            "quaternion": self.quaternion,
        }
        return {name: signals for name, signals in found.items() if signals is not None}


class SensorEntry(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One sensor on the bus."""

    id: str
    map: str
    subject: str
    segment: str
    dbc: str | None = None
    add_to_ids: int = 0
    mounting: Quaternion | None = None
    rate_hz: float | None = None
    heading_free: bool = False
    """It delivers orientation, and no magnetometer holds its heading."""


class SensorTable(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """All sensors on the bus."""

    sensor: list[SensorEntry]


@cache
def read_database(path: Path) -> Any:
    """Return a DBC as cantools reads it. Raises BadMap, FileNotFoundError."""
    from cantools import database
    from cantools.database.errors import Error

    if not path.is_file():
        raise FileNotFoundError(2, "no such DBC", str(path))
    try:
        read: Any = database.load_file(path)
    except (Error, ValueError) as error:
        raise BadMap(
            f"{path} cannot be read as a CAN database: {' '.join(str(error).split())[:200]}"
        ) from None
    if not read.messages:
        raise BadMap(f"{path} describes no message at all; give the DBC that came with the sensor")
    return read
