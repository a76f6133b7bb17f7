"""A site file: one room, its subjects and its nodes, as TOML. What it does not know is refused by name."""

import ipaddress
import re
import tomllib
from difflib import get_close_matches
from importlib.resources import files
from pathlib import Path
from typing import Any, Literal, get_args

import msgspec

from brachium_body.segments import Segment
from brachium_wire import keys

ServiceName = Literal["router", "gateway", "slimevr", "fuse", "record", "web", "view"]
SERVICES: tuple[ServiceName, ...] = get_args(ServiceName)

Quaternion = tuple[float, float, float, float]


class BadSite(ValueError):
    """A site file that cannot be used; the text says where and what to write instead."""


class _Table(msgspec.Struct, frozen=True, kw_only=True):
    """A table of the file. Unknown keys are refused before it is made."""


class Ports(_Table, frozen=True, kw_only=True):
    """Where the services of this machine listen."""

    router: int = 7447
    gateway: int = 8765
    web: int = 8080
    view: int = 9090


class Room(_Table, frozen=True, kw_only=True):
    """The room and what runs in it."""

    id: str
    bind: str = "127.0.0.1"
    """The address of one interface; never all of them."""
    ports: Ports = Ports()
    services: tuple[ServiceName, ...] = ("router", "gateway", "fuse", "record")
    recordings: str = "recordings"
    """Folder of the recorder."""
    sessions: str = "sessions"
    """Folder of the pages' sessions."""
    calibrations: str = "calibrations"
    """Folder of the nodes' sensor calibrations, as `brachium sensor --out` writes it."""
    password: bool | None = None
    """Ask for the room's password; left out: beyond loopback, yes."""


class Subject(_Table, frozen=True, kw_only=True):
    """A person, under a pseudonym."""

    id: str
    side: Literal["right", "left", "both"] = "right"
    height_m: float | None = None
    lengths_m: dict[str, float] = {}
    facing_deg: float | None = None
    exercise: str = ""


class Node(_Table, frozen=True, kw_only=True):
    """A wearable and where it is worn."""

    id: str
    token_sha256: str
    subject: str | None = None
    segment: Segment | None = None
    mounting: Quaternion | None = None


class Tracker(_Table, frozen=True, kw_only=True):
    """A sensor of a SlimeVR tracker and where it is worn."""

    mac: str
    subject: str
    segment: Segment | None = None
    """Left out: where the tracker itself says that it is worn."""
    sensor: int | None = None
    mounting: Quaternion | None = None
    rate_hz: float = 100.0


class Shimmer(_Table, frozen=True, kw_only=True):
    """A Shimmer3 and where it is worn."""

    port: str
    """Its serial port, as `/dev/rfcomm0`."""
    subject: str
    """`p01.ref`: a second set of sensors on p01."""
    segment: Segment
    rate_hz: float = 51.2
    accelerometer: Literal["wide-range", "low-noise"] = "wide-range"
    mounting: Quaternion | None = None


class Site(_Table, frozen=True, kw_only=True):
    """The whole file."""

    room: Room
    subject: tuple[Subject, ...] = ()
    node: tuple[Node, ...] = ()
    tracker: tuple[Tracker, ...] = ()
    shimmer: tuple[Shimmer, ...] = ()


def find(name: str) -> Path:
    """Return the path of a site file: as given, or one that is shipped under that name."""
    path = Path(name)
    shipped = Path(str(files("brachium") / "site" / path.name))
    if path.exists() or not shipped.is_file() or path != Path(path.name):
        return path
    return shipped


def read(path: Path) -> Site:
    """Return the site that a file describes. Raises BadSite, or FileNotFoundError."""
    try:
        return parse(path.read_text("utf-8"))
    except BadSite as error:
        raise BadSite(f"{path}: {error}") from None
    except UnicodeDecodeError as error:
        raise BadSite(f"{path}: not UTF-8 text ({error.reason} at byte {error.start})") from None


def parse(text: str) -> Site:
    """Return the site that a text describes, or raise BadSite."""
    try:
        tables = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise BadSite(f"not TOML: {error}") from None
    _refuse_unknown(tables, Site, "")
    try:
        site = msgspec.convert(tables, Site)
    except msgspec.ValidationError as error:
        raise BadSite(str(error)) from None
    _check(site)
    return site


def _refuse_unknown(value: Any, kind: type[msgspec.Struct], where: str) -> None:
    if not isinstance(value, dict):
        return
    known = {field.name: field.type for field in msgspec.structs.fields(kind)}
    for name, inner in value.items():
        if name not in known:
            near = get_close_matches(name, known, n=1)
            hint = f"did you mean {near[0]!r}?" if near else f"write one of {', '.join(known)}"
            raise BadSite(f"{where}{name!r} is not known; {hint}")
        tables = [t for t in (known[name], *get_args(known[name])) if _is_table(t)]
        for item in inner if isinstance(inner, list) else [inner]:
            if tables:
                _refuse_unknown(item, tables[0], f"{where}{name}: ")


def _is_table(kind: Any) -> bool:
    return isinstance(kind, type) and issubclass(kind, _Table)


def _check(site: Site) -> None:
    try:
        keys.chunk(site.room.id, "room")
        for subject in site.subject:
            keys.subject_chunk(subject.id)
        for node in site.node:
            keys.chunk(node.id, "node")
    except keys.BadKey as error:
        raise BadSite(str(error)) from None
    subjects = _once([subject.id for subject in site.subject], "subject")
    _once([node.id for node in site.node], "node")
    worn: tuple[Node | Tracker | Shimmer, ...] = (*site.node, *site.tracker, *site.shimmer)
    places = [f"{one.segment} of {one.subject}" for one in worn if one.segment is not None]
    _once(places, "sensor place")
    for tracker in site.tracker:
        if tracker.subject not in subjects:
            raise BadSite(
                f"tracker {tracker.mac!r} names subject {tracker.subject!r}, which no [[subject]] has"
            )
    for node in site.node:
        if (node.subject is None) != (node.segment is None):
            raise BadSite(f"node {node.id!r}: give both subject and segment, or neither")
        if node.subject is not None and node.subject not in subjects:
            raise BadSite(f"node {node.id!r} names subject {node.subject!r}, which no [[subject]] has")
        if not re.fullmatch("[0-9a-f]{64}", node.token_sha256):
            raise BadSite(f"node {node.id!r}: token_sha256 must be 64 digits of lower-case hex")
    for shimmer in site.shimmer:
        if shimmer.subject not in subjects:
            raise BadSite(
                f"shimmer {shimmer.port!r} names subject {shimmer.subject!r}, which no [[subject]] has"
            )
    _once([shimmer.port for shimmer in site.shimmer], "port")
    _check_listening(site.room)


def _check_listening(room: Room) -> None:
    ports = msgspec.structs.asdict(room.ports)
    for name, port in ports.items():
        if not 1 <= port <= 65535:
            raise BadSite(f"ports: {name} {port} cannot be used: write 1 to 65535")
    if len(set(ports.values())) < len(ports):
        written = ", ".join(f"{name} {port}" for name, port in ports.items())
        raise BadSite(f"ports: {written}: each service needs a port of its own")
    try:
        everywhere = ipaddress.ip_address(room.bind).is_unspecified
    except ValueError:
        everywhere = False  # a name
    if everywhere:
        raise BadSite(f"bind {room.bind!r} is every interface; write the address of one")


def _once(names: list[str], what: str) -> set[str]:
    for name in names:
        if names.count(name) > 1:
            raise BadSite(f"{what} {name!r} is there twice; write it once")
    return set(names)
