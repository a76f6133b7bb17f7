"""The door for trackers as a service: where it listens, how it ends, who else has its subject."""

import socket
import struct
import threading

import pytest

from brachium_nodes.host_claim import HostClaims
from brachium_nodes.listening import BadAddress, CannotListen
from brachium_nodes.slimevr.allowed import from_text
from brachium_nodes.slimevr.service import SlimeVRSettings, run
from brachium_wire import keys
from brachium_wire.bus import Bus
from brachium_wire.messages import Health

pytestmark = pytest.mark.network

MAC = "a1b2c3d4e5f6"
HANDSHAKE = struct.pack(">IQ7I", 3, 0, 1, 10, 2, 0, 0, 0, 22) + b"\x011" + bytes.fromhex(MAC)
SENSOR = struct.pack(">IQBBBHBBB", 15, 1, 0, 1, 10, 0, 0, 0, 0)


@pytest.mark.parametrize(
    ("bind", "says"), [("0.0.0.0", "one interface"), ("::1", "IPv4"), ("lan", "is no address")]
)
def test_it_listens_on_one_ipv4_address(bind, says):
    with pytest.raises(BadAddress, match=says):
        run(SlimeVRSettings(bind=bind), threading.Event())


def test_a_port_that_is_taken_is_told_in_one_line(endpoint):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind(("127.0.0.1", 0))
        port = other.getsockname()[1]
        with pytest.raises(CannotListen, match=f"port {port} of 127.0.0.1 is in use"):
            run(SlimeVRSettings(endpoint=endpoint, port=port), threading.Event())


class Door:
    """The service in a thread, and its health."""

    def __init__(self, endpoint: str, listener, **more: object) -> None:
        self.stop, self._listener = threading.Event(), listener
        settings = SlimeVRSettings(
            **{"endpoint": endpoint, "room": "test", "port": 0, "trackers": (from_text(f"{MAC}=p01/hand_r"),)}
            | more
        )
        self._thread = threading.Thread(target=run, args=(settings, self.stop))
        self._thread.start()
        listener.until(lambda: self.health, "the door")
        self.at = ("127.0.0.1", int(self.health[-1].text.rpartition(":")[2]))

    @property
    def health(self) -> list[Health]:
        return self._listener.of("health", "slimevr/slimevr")

    def end(self) -> None:
        self.stop.set()
        self._thread.join(timeout=15.0)
        assert not self._thread.is_alive()


def test_a_subject_that_comes_in_elsewhere_is_left_to_that_host(endpoint, bus: Bus, listener):
    claims = HostClaims(bus, "test", "gateway")
    door = Door(endpoint, listener)
    token = keys.alive("test", "node", f"slimevr-{MAC}.0")
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as tracker:
        tracker.sendto(HANDSHAKE, door.at)
        tracker.sendto(SENSOR, door.at)
        listener.until(lambda: bus.alive(token), "the tracker")
        claims.claim("p01")  # at once with the other: the first in the alphabet stays
        listener.until(lambda: not bus.alive(token), "the tracker's end")
        listener.until(
            lambda: (told := listener.of("status", "hand_r")) and not told[-1].connected, "its last status"
        )
        tracker.sendto(HANDSHAKE, door.at)
        tracker.sendto(SENSOR, door.at)
        listener.until(lambda: door.health[-1].counts.get("refused"), "the refusal")
        assert not bus.alive(token)
        claims.release("p01")
    door.end()
    assert door.health[-1].counts["handshakes"] == 2


def test_hostile_datagrams_are_counted_and_a_good_tracker_beside_them_loses_nothing(
    endpoint, bus: Bus, listener
):
    door = Door(endpoint, listener)
    with (
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as tracker,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger,
    ):
        tracker.sendto(HANDSHAKE, door.at)
        tracker.sendto(SENSOR, door.at)
        listener.until(lambda: bus.alive(keys.alive("test", "node", f"slimevr-{MAC}.0")), "the tracker")
        turn = struct.pack(">BB4fB", 0, 1, 0.0, 0.0, 0.0, 1.0, 0)
        for number in range(2, 102):
            for junk in (b"", b"\xff" * 2000, struct.pack(">IQ", 17, 2**64 - 1) + turn, HANDSHAKE[:30]):
                stranger.sendto(junk, door.at)
            tracker.sendto(struct.pack(">IQ", 17, number) + turn, door.at)
            if number % 20 == 0:  # as many at once as a socket's queue surely holds
                listener.until(lambda n=number: received(listener) >= n - 1, "what was sent so far")
        listener.until(lambda: received(listener) == 100, "all samples")
        listener.until(lambda: door.health[-1].drops.get("stranger", 0) >= 300, "the strangers' drops")
        assert door.health[-1].drops["no_mac"] == 100
    door.end()
    last = listener.of("status", "hand_r")[-1]
    assert (last.received, last.lost) == (100, 0)


def received(listener) -> int:
    return sum(len(b.offsets) // 4 for b in listener.of("imu", "hand_r"))
