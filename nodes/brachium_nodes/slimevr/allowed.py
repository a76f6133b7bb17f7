"""Which trackers may come in: by MAC address, and whose segment each of their sensors is."""

import re
from collections.abc import Iterable
from dataclasses import dataclass, replace

from brachium_body.lengths import from_height
from brachium_body.segments import SEGMENTS, Segment
from brachium_nodes.node_frames import MAX_RATE_HZ
from brachium_nodes.places import place
from brachium_nodes.roster import SLIMEVR
from brachium_nodes.slimevr.positions import SEGMENT_AT
from brachium_wire import keys
from brachium_wire.messages import Quaternion

RATE_HZ = 100.0
"""At which the trackers' firmware bundles what it sends."""
MAX_SENSORS = 16
HOW = "write MAC[/SENSOR]=SUBJECT[/SEGMENT], as in a1:b2:c3:d4:e5:f6=p01/forearm_r"


@dataclass(frozen=True, kw_only=True)
class Allowed:
    """One sensor of a tracker, or all of them, that may come in."""

    mac: str
    subject: str
    segment: str | None = None
    """None: where the tracker itself says that it is worn."""
    sensor: int | None = None
    """None: sensor 0 where a segment is named, else every sensor of the tracker."""
    mounting: Quaternion | None = None
    """Nominal segment_from_sensor, for a tracker that is worn otherwise than usual."""
    rate_hz: float = RATE_HZ


def from_text(text: str) -> Allowed:
    """Return what `MAC[/SENSOR]=SUBJECT[/SEGMENT]` allows, or raise ValueError."""
    tracker, joined, place_name = text.partition("=")
    mac, numbered, sensor = tracker.partition("/")
    subject, with_segment, segment = place_name.partition("/")
    if not joined or (numbered and not re.fullmatch("[0-9]{1,2}", sensor)) or (with_segment and not segment):
        raise ValueError(f"{text[:80]!r} assigns no tracker; {HOW}")
    return Allowed(
        mac=mac, subject=subject, segment=segment or None, sensor=int(sensor) if numbered else None
    )


def mac_digits(mac: str) -> str:
    """Return the twelve hex digits of a MAC address in lower case, or raise ValueError."""
    digits = re.sub("[:-]", "", mac).lower()
    if not re.fullmatch("[0-9a-f]{12}", digits):
        raise ValueError(f"{mac[:80]!r} is no MAC address; {HOW}")
    return digits


def node_id(mac: str, sensor: int) -> str:
    """Return the node id of one sensor of a tracker; `mac` is twelve hex digits."""
    return f"{SLIMEVR}{mac}.{sensor}"


def from_node(node: str, subject: str, segment: str, mounting: Quaternion | None) -> Allowed:
    """Return what allows the sensor of this node id, or raise ValueError."""
    mac, dot, sensor = node.removeprefix(SLIMEVR).partition(".")
    if not node.startswith(SLIMEVR) or not dot or not re.fullmatch("[0-9]{1,2}", sensor):
        raise ValueError(f"node {node[:80]!r} is no SlimeVR tracker; write {SLIMEVR}a1b2c3d4e5f6.0")
    return Allowed(mac=mac, subject=subject, segment=segment, sensor=int(sensor), mounting=mounting)


def usual_mounting(segment: str) -> Quaternion:
    """Return segment_from_sensor of a tracker worn in the usual place: its y up along the hanging limb, its z
    off the skin, as SlimeVR's own mounting has it."""
    known: Segment = next(s for s in SEGMENTS if s == segment)
    return place(known, from_height(1.75)).mounting


class AllowList:
    """The trackers that are answered. Raises ValueError for entries that contradict one another."""

    def __init__(self, entries: Iterable[Allowed] = ()) -> None:
        self._of: dict[str, dict[int | None, Allowed]] = {}
        places: dict[tuple[str, str], str] = {}
        for entry in map(_checked, entries):
            if entry.sensor in self._of.get(entry.mac, {}):
                which = "" if entry.sensor is None else f"sensor {entry.sensor} of "
                raise ValueError(f"{which}tracker {entry.mac} is assigned twice; write it once")
            if entry.segment is not None:
                other = places.setdefault((entry.subject, entry.segment), (node := _name(entry)))
                if other != node:
                    raise ValueError(f"{entry.segment} of {entry.subject} is given to {other} and to {node}")
            self.add(entry)

    def __contains__(self, mac: object) -> bool:
        return mac in self._of

    def of(self, mac: str, sensor: int, position: int) -> Allowed | None:
        """Return whose segment a sensor is, or None when nobody said and its own `position` tells none."""
        sensors = self._of.get(mac, {})
        entry = sensors.get(sensor) or sensors.get(None)
        if entry is None or entry.segment is not None:
            return entry
        segment = SEGMENT_AT.get(position)
        return None if segment is None else replace(entry, segment=segment, sensor=sensor)

    def add(self, entry: Allowed) -> None:
        """Allow one more sensor, or assign it elsewhere. Raises ValueError."""
        entry = _checked(entry)
        self._of.setdefault(entry.mac, {})[entry.sensor] = entry


def _name(entry: Allowed) -> str:
    return node_id(entry.mac, entry.sensor or 0)


def _checked(entry: Allowed) -> Allowed:
    """Return the entry with its MAC in digits and its sensor named, or raise ValueError."""
    keys.subject_chunk(entry.subject)
    if entry.segment is not None and entry.segment not in SEGMENTS:
        raise ValueError(f"segment {entry.segment[:80]!r} is not known; choose one of {', '.join(SEGMENTS)}")
    if entry.sensor is not None and not 0 <= entry.sensor < MAX_SENSORS:
        raise ValueError(f"sensor {entry.sensor} cannot be: a tracker has sensors 0 to {MAX_SENSORS - 1}")
    if not 1.0 <= entry.rate_hz <= MAX_RATE_HZ:
        raise ValueError(f"rate {entry.rate_hz:g} Hz cannot be used: 1 to {MAX_RATE_HZ:g} Hz are taken")
    sensor = 0 if entry.sensor is None and entry.segment is not None else entry.sensor
    return replace(entry, mac=mac_digits(entry.mac), sensor=sensor)
