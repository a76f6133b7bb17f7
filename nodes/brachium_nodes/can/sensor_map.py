"""Which frames of which bus are which sensor: two small TOML files and a DBC, checked against each other.

A map says what one kind of sensor sends, in the words of its DBC; the sensor table says which of them are on
the bus, on whom, and where. docs/can.md has both formats.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from typing import Any

from brachium_body.segments import SEGMENTS
from brachium_nodes.can.grouping import TIMEOUT_NS, Key
from brachium_nodes.can.map_files import (
    SHIPPED,
    SensorEntry,
    SensorMap,
    SensorTable,
    read_database,
)
from brachium_nodes.can.toml_records import BadMap, read_toml
from brachium_wire import keys
from brachium_wire.messages import Quaternion


@dataclass(frozen=True, kw_only=True)
class CanSensor:
    """One sensor on the bus."""

    id: str
    subject: str
    segment: str
    mounting: Quaternion | None
    rate_hz: float
    heading_free: bool
    map: SensorMap
    messages: Mapping[int, Any]
    """cantools messages of this sensor by the id they have on this bus; an extended id has bit 31 set."""
    key: Key | None
    """None: each sample is one frame without a number."""
    before: str | None
    """The message whose key stands before the others; None where each carries it."""


def read_sensors(path: Path, dbc: Path | None = None) -> tuple[CanSensor, ...]:
    """Return the sensors of a table. `dbc` replaces the one that the maps name.

    Raises BadMap, FileNotFoundError; ModuleNotFoundError without the extra `can`.
    """
    table = read_toml(path, SensorTable)
    if not table.sensor:
        raise BadMap(f"{path}: no [[sensor]]; write one for each sensor on the bus")
    sensors = tuple(_sensor(path, entry, dbc) for entry in table.sensor)
    _check_apart(path, sensors)
    return sensors


def _sensor(path: Path, entry: SensorEntry, dbc: Path | None) -> CanSensor:
    keys.chunk(entry.id, f"{path}: id")
    keys.subject_chunk(entry.subject)
    if entry.segment not in SEGMENTS:
        raise BadMap(
            f"{path}: segment {entry.segment!r} of {entry.id} is not known; choose of {', '.join(SEGMENTS)}"
        )
    if entry.mounting is not None and not 0.999 < sum(v * v for v in entry.mounting) < 1.001:
        raise BadMap(f"{path}: mounting of {entry.id} {list(entry.mounting)} is no quaternion of length 1")
    place = _map_path(path, entry.map)
    made = read_toml(place, SensorMap)
    rate_hz = made.rate_hz if entry.rate_hz is None else entry.rate_hz
    if not 1.0 <= rate_hz <= 2000.0:
        raise BadMap(f"{path}: rate {rate_hz:g} Hz of {entry.id} cannot be; write 1 to 2000")
    chosen = dbc or (path.parent / entry.dbc if entry.dbc else place.parent / made.dbc)
    database = read_database(chosen)
    wanted = _checked(place, chosen, made, database)
    before = _before(place, made)
    messages = {_wire_id(message, entry.add_to_ids, path): message for message in wanted.values()}
    return CanSensor(
        id=entry.id,
        subject=entry.subject,
        segment=entry.segment,
        mounting=entry.mounting,
        rate_hz=rate_hz,
        heading_free=entry.heading_free,
        map=made,
        messages=messages,
        key=_key(place, made, wanted, rate_hz),
        before=before,
    )


def _map_path(table: Path, name: str) -> Path:
    shipped = SHIPPED / f"{name}.toml"
    if shipped.is_file():
        return shipped
    own = table.parent / name
    if own.is_file():
        return own
    known = ", ".join(sorted(p.stem for p in SHIPPED.glob("*.toml")))
    raise BadMap(f"{table}: map {name!r} is neither shipped ({known}) nor a file beside the table")


def _checked(place: Path, dbc: Path, made: SensorMap, database: Any) -> dict[str, Any]:
    """Return the messages that the map speaks of, by name, all their signals being there."""
    given = made.quantities()
    if not ({"acceleration", "angular_rate"} <= given.keys() or "quaternion" in given):
        raise BadMap(f"{place}: give [acceleration] and [angular_rate], or [quaternion]")
    wanted = [(s.message, s.signals, 4 if name == "quaternion" else 3) for name, s in given.items()]
    if made.key is not None:
        wanted += [(message, [signal], 1) for message, signal in made.key.signals.items()]
    found: dict[str, Any] = {}
    for message, signals, count in wanted:
        if len(signals) != count:
            raise BadMap(f"{place}: {message}: {count} signals are needed; came {', '.join(signals)}")
        try:
            found[message] = database.get_message_by_name(message)
        except KeyError:
            known = ", ".join(m.name for m in database.messages[:20])
            raise BadMap(f"{place}: {dbc} has no message {message!r}; it has {known}") from None
        have = {signal.name for signal in found[message].signals}
        for signal in signals:
            if signal not in have:
                raise BadMap(f"{place}: {message} of {dbc} has no signal {signal!r}; it has {sorted(have)}")
    for name, quantity in given.items():
        if not isfinite(quantity.scale) or quantity.scale == 0.0:
            raise BadMap(f"{place}: scale of {name} must be a number other than 0")
    return found


def _before(place: Path, made: SensorMap) -> str | None:
    measured = {signals.message for signals in made.quantities().values()}
    if made.key is None:
        if len(measured) > 1:
            raise BadMap(
                f"{place}: nothing numbers the samples, so frames of {', '.join(sorted(measured))} cannot be "
                "put together; have the sensor send a counter or its sample time, or all in one frame"
            )
        return None
    carriers = set(made.key.signals)
    if measured == carriers:
        return None
    if len(carriers) == 1 and not carriers & measured:
        return next(iter(carriers))
    raise BadMap(
        f"{place}: [key] must name a signal in every message with a quantity, or in one message before them"
    )


def _key(place: Path, made: SensorMap, messages: Mapping[str, Any], rate_hz: float) -> Key | None:
    if made.key is None:
        return None
    moduli = set()
    for message, name in made.key.signals.items():
        signal = next(s for s in messages[message].signals if s.name == name)
        moduli.add(2.0**signal.length)
    if len(moduli) != 1:
        raise BadMap(f"{place}: the key's signals must be of one length in bits")
    step = 1.0 if made.key.tick_s is None else 1.0 / (rate_hz * made.key.tick_s)
    modulus, period_ns = moduli.pop(), 1e9 / rate_hz
    if made.key.tick_s is not None and step < 1.0:
        raise BadMap(f"{place}: tick_s {made.key.tick_s:g} is coarser than a period at {rate_hz:g} Hz")
    if modulus / step * period_ns < 4 * TIMEOUT_NS:
        raise BadMap(
            f"{place}: a counter that wraps after {modulus / step * period_ns * 1e-6:.0f} ms cannot tell "
            f"samples apart; {4 * TIMEOUT_NS * 1e-6:.0f} ms are needed"
        )
    return Key(step, modulus, period_ns)


def _wire_id(message: Any, added: int, path: Path) -> int:
    number = message.frame_id + added
    if not 0 <= number < (1 << 29 if message.is_extended_frame else 1 << 11):
        raise BadMap(f"{path}: add_to_ids {added} makes {number:#x} of {message.name}: that is no CAN id")
    return int(number | (1 << 31 if message.is_extended_frame else 0))


def _check_apart(path: Path, sensors: tuple[CanSensor, ...]) -> None:
    ids: dict[int, str] = {}
    for sensor in sensors:
        for number in sensor.messages:
            if number in ids:
                raise BadMap(
                    f"{path}: {ids[number]} and {sensor.id} both send {number & 0x1FFFFFFF:#x}; "
                    "give their sensors other ids, and say so with add_to_ids"
                )
            ids[number] = sensor.id
    for what in ("id", "place"):
        seen = [s.id if what == "id" else (s.subject, s.segment) for s in sensors]
        twice = {one for one in seen if seen.count(one) > 1}
        if twice:
            raise BadMap(f"{path}: {twice.pop()} is there twice; each sensor has its own {what}")
