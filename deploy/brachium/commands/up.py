"""Start every service that a site file names, watch them, and start again what ends. `lan.toml` is shipped.

brachium up lan.toml
"""

import argparse
import os
import threading
from pathlib import Path

from brachium.processes import Processes
from brachium.secrets_store import RoomSecrets, load_or_make, room_folder, write_users
from brachium.shell import Failed, stop_on_signals
from brachium.site_file import Site, find, read
from brachium.site_services import endpoint, services, session, wants_password

LOOK_S = 0.2


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
    with Processes() as processes:
        for service in services(site, path.resolve(), join_token=secrets.join_token, users_file=users):
            processes.start(service.name, service.words)
        _tell(site, path, secrets, with_password=with_password)
        _watch(site, processes, stop)
    return 0


def _watch(site: Site, processes: Processes, stop: threading.Event) -> None:
    from brachium_wire import keys
    from brachium_wire.bus import Bus, NoRouter
    from brachium_wire.codec import encode

    try:
        bus = Bus.open(endpoint(site), stop=stop)
    except NoRouter as error:
        if stop.is_set():
            return
        raise Failed(str(error)) from None
    with bus:
        for subject in site.subject:
            bus.retain(keys.session(site.room.id, subject.id), encode(session(subject)))
        while not stop.wait(LOOK_S):
            processes.revive()


def _tell(site: Site, path: Path, secrets: RoomSecrets, *, with_password: bool) -> None:
    room = site.room
    print(f"room {room.id} from {path}: {', '.join(room.services)}; router at {endpoint(site)}", flush=True)
    print(f"wearables: ws://{room.bind}:{room.ports.gateway}/node  join token {secrets.join_token}")
    attach = f"brachium monitor --room {room.id} --endpoint {endpoint(site)}"
    if with_password:
        attach = f"BRACHIUM_PASSWORD={secrets.password} {attach}"
    print(f"attach a program, here or on another machine: {attach}", flush=True)
    if with_password:
        _print_code(attach)


def _print_code(text: str) -> None:
    """Print a QR code of `text` where the package for it is installed: `brachium[site]`."""
    try:
        import segno
    except ModuleNotFoundError:
        return
    segno.make(text, error="l").terminal(compact=True)
