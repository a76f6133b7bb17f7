"""Start every service that a site file names, watch them, and start again what ends. `lan.toml` is shipped.

brachium up lan.toml
"""

import argparse
import os
import socket
import threading
import time
from pathlib import Path
from typing import TYPE_CHECKING

from brachium.processes import Processes
from brachium.secrets_store import RoomSecrets, load_or_make, room_folder, write_users
from brachium.shell import Failed, Usage, stop_on_signals
from brachium.site_file import Site, find, read
from brachium.site_services import Service, endpoint, on_loopback, services, session, wants_password

if TYPE_CHECKING:
    from brachium_wire.bus import Bus

LOOK_S = 0.2
ROUTER_WITHIN_S = 10.0


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    parser.add_argument("site", metavar="FILE.toml", help="the site file, or lan.toml for the shipped one")
    parser.add_argument(
        "--print", action="store_true", help="print the site file as it would be read, and end"
    )


def run(args: argparse.Namespace) -> int:
    """Run the site until Ctrl-C."""
    path = find(args.site)
    site = read(path)
    if args.print:
        print(path.read_text("utf-8"))
        return 0
    stop = stop_on_signals()
    secrets = load_or_make(room_folder(site.room.id))
    with_password = wants_password(site)
    users = None
    if with_password:
        from brachium_wire.bus import PASSWORD_VARIABLE, ROOM_USER

        users = write_users(room_folder(site.room.id), ROOM_USER, secrets.password)
        os.environ[PASSWORD_VARIABLE] = secrets.password  # ours and the services'
    wanted = services(site, path.resolve(), join_token=secrets.join_token, users_file=users)
    for service in wanted:
        _check_free(service, site.room.bind)
    with Processes() as processes:
        for service in wanted:
            processes.start(service.name, service.words)
        _tell(site, path, secrets, with_password=with_password)
        _watch(site, wanted, processes, stop)
    return 0


def _check_free(service: Service, bind: str) -> None:
    """Raise Failed when the service's port cannot be had: it would be started for nothing, over and over."""
    if service.port is None:
        return
    try:
        found = socket.getaddrinfo(bind, service.port, type=socket.SOCK_STREAM)[0]
        with socket.socket(found[0], found[1]) as probe:
            if os.name == "posix":  # elsewhere this takes a port that is in use
                probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            probe.bind(found[4])
    except OSError as error:
        why = error.strerror or error
        raise Failed(
            f"{service.name} cannot listen at {bind} port {service.port} ({why}): "
            "is this site up already? else write another address or port in its file"
        ) from None


def _watch(site: Site, wanted: list[Service], processes: Processes, stop: threading.Event) -> None:
    from brachium_wire import keys
    from brachium_wire.codec import encode

    bus = _join(site, processes, stop)
    if bus is None:
        return

    def changed(key: str, alive: bool) -> None:
        kind = keys.parse(key).detail.split("/")[0]
        for service in wanted:
            if alive and service.kind == kind:
                processes.children[service.name].came_up = True

    with bus:
        bus.watch_alive(keys.services(site.room.id, "*/*/alive"), changed)
        for subject in site.subject:
            bus.retain(keys.session(site.room.id, subject.id), encode(session(subject)))
        while not stop.wait(LOOK_S):
            _give_up_if_hopeless(processes)
            processes.revive()


def _join(site: Site, processes: Processes, stop: threading.Event) -> "Bus | None":
    """Return the site's bus, or None when `stop` was set first. Raises Failed or Usage."""
    from brachium_wire.bus import Bus, NoRouter

    deadline = time.monotonic() + ROUTER_WITHIN_S
    while not stop.is_set():
        _give_up_if_hopeless(processes)
        try:
            return Bus.open(endpoint(site), stop=stop, timeout_s=0.0)
        except NoRouter as error:
            if time.monotonic() > deadline:
                raise Failed(str(error)) from None
        stop.wait(LOOK_S)
    return None


def _give_up_if_hopeless(processes: Processes) -> None:
    child = processes.hopeless()
    if child is not None and child.process is not None:
        code = child.process.returncode
        text = f"{child.name} ended (exit {code}) and says why above; everything of this site is stopped"
        raise Usage(text) if code == 2 else Failed(text)


def _tell(site: Site, path: Path, secrets: RoomSecrets, *, with_password: bool) -> None:
    room = site.room
    print(f"room {room.id} from {path}: {', '.join(room.services)}; router at {endpoint(site)}", flush=True)
    print(f"wearables: ws://{room.bind}:{room.ports.gateway}/node  join token {secrets.join_token}")
    attach = f"brachium monitor --room {room.id} --endpoint {endpoint(site)}"
    if with_password:
        attach = f"BRACHIUM_PASSWORD={secrets.password} {attach}"
    where = "on this machine" if on_loopback(site) else "here or on another machine"
    print(f"attach a program, {where}: {attach}", flush=True)
    if with_password:
        _print_code(attach)


def _print_code(text: str) -> None:
    """Print a QR code of `text` where the package for it is installed: `brachium[site]`."""
    try:
        import segno
    except ModuleNotFoundError:
        return
    segno.make(text, error="l").terminal(compact=True)
