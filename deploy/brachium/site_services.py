"""A site file to the command lines of its services. Pure: nothing is started here."""

import hashlib
import ipaddress
from dataclasses import dataclass
from pathlib import Path

from brachium.site_file import Shimmer, Site, Subject
from brachium_wire.messages import Session


@dataclass(frozen=True, kw_only=True)
class Service:
    """One process of a site: its name and its command line after `brachium`."""

    name: str
    words: list[str]
    kind: str
    """What its keys say it is."""
    port: int | None = None
    """Where it listens."""


KINDS = {
    "router": "router",
    "gateway": "gateway",
    "slimevr": "slimevr",
    "fuse": "fusion",
    "record": "recorder",
    "web": "web",
    "view": "view",
}


def endpoint(site: Site) -> str:
    """Return where the site's router listens."""
    host = f"[{site.room.bind}]" if ":" in site.room.bind else site.room.bind
    return f"tcp/{host}:{site.room.ports.router}"


def wants_password(site: Site) -> bool:
    """Return whether programs need the room's password: as the file says, else beyond loopback."""
    return not on_loopback(site) if site.room.password is None else site.room.password


def on_loopback(site: Site) -> bool:
    """Return whether the site is for this machine alone."""
    try:
        return ipaddress.ip_address(site.room.bind).is_loopback
    except ValueError:
        return site.room.bind == "localhost"


def services(site: Site, path: Path, *, join_token: str, users_file: Path | None) -> list[Service]:
    """Return the services that the file names, in the order of their start."""
    room = site.room
    network = ["--room", room.id, "--endpoint", endpoint(site)]
    words = {
        "router": ["router", "--room", room.id, "--bind", room.bind, "--port", str(room.ports.router)],
        "gateway": ["gateway", *network, "--bind", room.bind, "--port", str(room.ports.gateway)],
        "slimevr": ["slimevr", *network, "--bind", room.bind, "--site", str(path)],
        "fuse": ["fuse", *network],
        "record": ["record", *network, "--out", room.recordings],
        "web": ["web", *network, "--bind", room.bind, "--port", str(room.ports.web)],
        "view": ["view", *network, "--web", "--web-port", str(room.ports.view)],
    }
    words["web"] += ["--sessions", room.sessions]
    words["gateway"] += [
        "--site",
        str(path),
        "--calibrations",
        room.calibrations,
        "--join-token-sha256",
        hashlib.sha256(join_token.encode()).hexdigest(),
    ]
    if users_file is not None:
        words["router"] += ["--users", str(users_file)]
    ports = {
        "router": room.ports.router,
        "gateway": room.ports.gateway,
        "web": room.ports.web,
        "view": room.ports.view,
    }
    named = [
        Service(name=name, words=words[name], kind=KINDS[name], port=ports.get(name))
        for name in room.services
    ]
    return [*named, *(_shimmer(shimmer, network) for shimmer in site.shimmer)]


def _shimmer(shimmer: Shimmer, network: list[str]) -> Service:
    words = ["--port", shimmer.port, "--subject", shimmer.subject, "--segment", shimmer.segment]
    words += ["--rate", str(shimmer.rate_hz), "--accelerometer", shimmer.accelerometer]
    if shimmer.mounting is not None:
        words.append(f"--mounting={','.join(map(str, shimmer.mounting))}")
    name = f"shimmer-{shimmer.subject}-{shimmer.segment}"
    return Service(name=name, words=["shimmer", *network, *words], kind="shimmer")


def session(subject: Subject) -> Session:
    """Return what the network is told of a subject."""
    return Session(
        side=subject.side,
        height_m=subject.height_m,
        lengths_m=subject.lengths_m,
        facing_deg=subject.facing_deg,
        exercise=subject.exercise,
    )
