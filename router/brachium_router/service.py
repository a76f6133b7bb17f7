"""The router as a running service: the same Rust code as zenohd, hosted by a Python process."""

import logging
import threading

import zenoh

from brachium_router.config import RouterSettings, endpoint, router_json5
from brachium_wire.bus import Bus
from brachium_wire.heart import BEAT_S, Heart

log = logging.getLogger(__name__)


class CannotListen(RuntimeError):
    """The router's address is not to be had; the text says why and what to do."""


def run(settings: RouterSettings, stop: threading.Event) -> None:
    """Route the room's messages until `stop` is set.

    Raises BadRouterSettings for settings that cannot be used and CannotListen when the address is taken.
    """
    where = endpoint(settings)
    # The router's own session speaks on the bus too: its health needs no second session and no password.
    with _listen(settings, where) as router, Bus(router, where) as bus:
        log.info("routing room %s at %s", settings.room, where)
        heart = Heart(bus, settings.room, "router", "router")
        heart.text = where
        while not stop.is_set():
            heart.counts["sessions"] = len(router.info.transports())
            heart.beat()
            stop.wait(BEAT_S / 4)
    log.info("router at %s ended", where)


def _listen(settings: RouterSettings, where: str) -> zenoh.Session:
    try:
        return zenoh.open(zenoh.Config.from_json5(router_json5(settings)))
    except zenoh.ZError as error:
        raise CannotListen(_reason(str(error), where)) from None


def _reason(text: str, where: str) -> str:
    if "in use" in text:
        return f"{where} is in use: another router is running, or choose another --port"
    if "Cannot assign" in text:
        return f"{where} is no address of this machine: give --bind the address of one of its interfaces"
    return f"the router cannot listen at {where}: {text.split(' at /')[0]}"
