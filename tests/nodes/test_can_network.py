"""Sensors on a CAN bus, through the real service, a real router and an interface of python-can."""

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from itertools import pairwise
from pathlib import Path

import can
import numpy as np
import pytest
from cantools import database

from brachium_nodes.can import grouping, service
from brachium_nodes.can.map_files import SHIPPED
from brachium_nodes.can.own_ids import OtherSender, OwnIds
from brachium_nodes.can.port import NoInterface, Port, PortSettings
from brachium_nodes.host_claim import HostClaims
from brachium_wire import keys
from brachium_wire.bus import Bus
from brachium_wire.codec import decode, encode
from brachium_wire.hosttime import HostClock, tell_host_time
from brachium_wire.messages import Health, Info, Origin, SampleBatch, SegmentPose, Skeleton, Status
from brachium_wire.samples import read_samples

pytestmark = pytest.mark.network

WITHIN_S = 60.0
ACC, GYR, MAG = (0.5, -0.25, 9.75), (0.125, 0.25, -0.5), (0.25, 0.5, -0.75)

SENSORS = """
[[sensor]]
id = "mti-1"
map = "mti-600"
subject = "p01"
segment = "upper_arm_r"
mounting = [1, 0, 0, 0]

[[sensor]]
id = "mti-2"
map = "mti-600"
subject = "p01"
segment = "forearm_r"
add_to_ids = 0x100

[[sensor]]
id = "lpms-3"
map = "lpms-orientation"
subject = "p01"
segment = "hand_r"
add_to_ids = 2
heading_free = true
"""


def until(found: Callable[[], object]) -> None:
    deadline, pause = time.monotonic() + WITHIN_S, threading.Event()
    while not found():
        assert time.monotonic() < deadline
        pause.wait(0.01)


@contextmanager
def running(settings: service.CanSettings) -> Iterator[None]:
    stop, failed = threading.Event(), []

    def run() -> None:
        try:
            service.run(settings, stop)
        except Exception as error:
            failed.append(error)

    thread = threading.Thread(target=run)
    thread.start()
    try:
        yield
    finally:
        stop.set()
        thread.join(15.0)
        assert not thread.is_alive()
        assert failed == []


class Sender:
    """Sensors as their data sheets have them, encoded by cantools."""

    def __init__(self, bus: can.BusABC) -> None:
        self.bus = bus
        self.mti = database.load_file(SHIPPED / "mti-600.dbc")
        self.lpms = database.load_file(SHIPPED / "lpms.dbc")

    def send(self, number: int, data: bytes) -> None:
        self.bus.send(can.Message(arbitration_id=number, data=data, is_extended_id=False))

    def mti_sample(self, ticks: int, offset: int, leave_out: tuple[str, ...] = ()) -> None:
        values = {
            "SampleTime": {"SampleTime": ticks},
            "RateOfTurn": dict(zip(("GyrX", "GyrY", "GyrZ"), GYR, strict=True)),
            "Acceleration": dict(zip(("AccX", "AccY", "AccZ"), ACC, strict=True)),
            "MagneticField": dict(zip(("MagX", "MagY", "MagZ"), MAG, strict=True)),
        }
        for name, signals in values.items():
            message = self.mti.get_message_by_name(name)
            if name not in leave_out:
                self.send(message.frame_id + offset, message.encode(signals))

    def lpms_sample(self) -> None:
        message = self.lpms.get_message_by_name("Channels1to4")
        signals = {"QuatW": 0.6, "QuatX": 0.0, "QuatY": 0.8, "QuatZ": 0.0}
        self.send(message.frame_id + 2, message.encode(signals))


@pytest.fixture
def patient(monkeypatch: pytest.MonkeyPatch) -> None:
    """Give no sample up: a busy machine holds a sender's thread up for longer than any bus delays."""
    monkeypatch.setattr(grouping, "TIMEOUT_NS", round(1e9 * WITHIN_S))


@pytest.mark.usefixtures("patient")
def test_sensors_of_two_makers_come_in_beside_a_babbling_node(endpoint: str, tmp_path: Path):
    table = tmp_path / "sensors.toml"
    table.write_text(SENSORS)
    port = PortSettings(interface="virtual", channel="brachium-in")
    settings = service.CanSettings(endpoint=endpoint, room="can", port=port, sensors=table, batch=2)
    with Bus.open(endpoint) as bus, can.Bus(interface="virtual", channel="brachium-in") as wire:
        inbox = bus.subscribe(keys.everything("can"))
        with running(settings):
            until(lambda: bool(bus.alive(keys.services("can", "can/*/alive"))))
            sender = Sender(wire)
            for number in range(40):
                sender.mti_sample(1000 + 100 * number, 0, ("RateOfTurn",) if number == 20 else ())
                sender.mti_sample(2**32 - 1000 + 100 * number & 2**32 - 1, 0x100, ())
                sender.lpms_sample()
                sender.send(0x7DF, bytes(8))
                sender.send(0x034, b"\x00")  # too short for what it says it is
                time.sleep(0.01)
            heard: list[tuple[str, bytes]] = []

            def complete() -> bool:
                heard.extend(inbox.drain())
                last = [decode(p, Status) for k, p in heard if keys.parse(k).topic == "status"]
                whole = {s.node for s in last if s.received >= 38} == {"mti-1", "mti-2", "lpms-3"}
                return whole and any(s.drops.get("bad_frame") == 40 for s in last)

            until(complete)
        heard += inbox.drain()
    by_topic: dict[tuple[str, str], list[bytes]] = {}
    for key, payload in heard:
        by_topic.setdefault((keys.parse(key).topic, keys.parse(key).detail), []).append(payload)
    info = decode(by_topic["info", "upper_arm_r"][0], Info)
    assert (info.node, info.chip, info.origin, info.host) == ("mti-1", "Xsens MTi-600", "worn", "can")
    assert info.magnetometer
    turned_info = decode(by_topic["info", "hand_r"][0], Info)
    assert turned_info.orientation_only
    assert turned_info.heading_free
    assert not info.heading_free
    batches = [read_samples(decode(p, SampleBatch)) for p in by_topic["imu", "upper_arm_r"]]
    numbers = [b.sequence + i for b in batches for i in range(len(b))]
    assert numbers == [n for n in range(39) if n != 20]  # the last waits for its follower
    for batch in batches:
        assert batch.acc is not None
        assert batch.gyr is not None
        assert batch.mag is not None
        np.testing.assert_allclose(batch.acc, np.tile(ACC, (len(batch), 1)), atol=1e-6)
        np.testing.assert_allclose(batch.gyr, np.tile(GYR, (len(batch), 1)), atol=1e-6)
        np.testing.assert_allclose(batch.mag, 50.0 * np.tile(MAG, (len(batch), 1)), atol=1e-4)
        assert batch.uncertainty_ns >= 50_000_000  # nobody asked the sensor for its time
    spans = np.diff([t for b in batches for t in b.time_ns]) / np.diff(numbers)
    np.testing.assert_allclose(spans, 1e7, rtol=0.6)
    turned = read_samples(decode(by_topic["imu", "hand_r"][0], SampleBatch))
    assert turned.quat is not None
    np.testing.assert_allclose(turned.quat[0], (0.6, 0.0, 0.8, 0.0), atol=1e-4)
    last = decode(by_topic["status", "upper_arm_r"][-1], Status)
    assert not last.connected
    assert (last.lost, last.drops["bad_frame"]) == (1, 40)
    assert last.drops["incomplete"] == 1
    assert decode(by_topic["status", "forearm_r"][-1], Status).lost == 0  # its time wrapped meanwhile
    health = decode(by_topic["health", "can/can"][-1], Health)
    assert health.drops["unknown_id"] == 40


def test_what_lies_in_the_interface_while_the_service_is_held_up_is_not_late(
    endpoint: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    held_up, there = threading.Event(), threading.Event()

    def slow(_claims: HostClaims, _subject: str) -> None:
        held_up.set()
        there.wait(WITHIN_S)
        threading.Event().wait(3e-9 * grouping.TIMEOUT_NS)

    monkeypatch.setattr(HostClaims, "other", slow)  # asked between a sample's frames
    table = tmp_path / "sensors.toml"
    table.write_text(SENSORS)
    port = PortSettings(interface="virtual", channel="brachium-held")
    settings = service.CanSettings(endpoint=endpoint, room="held", port=port, sensors=table, batch=1)
    with Bus.open(endpoint) as bus, can.Bus(interface="virtual", channel="brachium-held") as wire:
        inbox = bus.subscribe(keys.imu("held", "p01", "upper_arm_r"))
        with running(settings):
            until(lambda: bool(bus.alive(keys.services("held", "can/*/alive"))))
            sender = Sender(wire)
            for number in range(10):
                sender.mti_sample(100 * number, 0)
            assert held_up.wait(WITHIN_S)
            there.set()
            heard: list[tuple[str, bytes]] = []
            until(lambda: heard.extend(inbox.drain()) or len(heard) >= 9)
    assert [decode(payload, SampleBatch).sequence for _, payload in heard] == list(range(9))


JOINTS = 'subject = "p01"\nside = "right"\n'


def arm(tick: int, time_ns: int, origin: Origin = "worn") -> bytes:
    angle = 0.02 * tick
    pose = SegmentPose(
        quality="good",
        sequence=tick,
        world_from_segment=(float(np.cos(angle / 2)), float(np.sin(angle / 2)), 0.0, 0.0),
    )
    still = SegmentPose(quality="good", sequence=tick, world_from_segment=(1.0, 0.0, 0.0, 0.0))
    return encode(
        Skeleton(
            time_ns=time_ns,
            side="right",
            origin=origin,
            forward="facing",
            trunk_from_world=(1.0, 0.0, 0.0, 0.0),
            segments={"upper_arm_r": still, "forearm_r": pose},
            positions={},
            angles={"elbow_flexion": angle},
        )
    )


@contextmanager
def moving_arm(bus: Bus, room: str, origin: Origin = "worn") -> Iterator[None]:
    """Skeletons at 50 Hz, with a host that tells its time."""
    clock, stop = HostClock(), threading.Event()
    tell_host_time(bus, room, "gateway", clock.now_ns)
    info = Info(node="n", rate_hz=100.0, origin=origin, host="gateway")
    bus.retain(keys.info(room, "p01", "forearm_r"), encode(info))

    def move() -> None:
        tick = 0
        begun = time.monotonic()
        while not stop.wait(max(0.0, begun + 0.02 * tick - time.monotonic())):
            payload = arm(tick, clock.at(round((begun + 0.02 * tick) * 1e9)), origin)
            bus.put(keys.skeleton(room, "p01", "right"), payload)
            tick += 1

    thread = threading.Thread(target=move)
    thread.start()
    try:
        yield
    finally:
        stop.set()
        thread.join()


def test_an_arm_goes_out_while_it_moves_and_says_invalid_when_it_stops(endpoint: str, tmp_path: Path):
    table = tmp_path / "joints.toml"
    table.write_text(JOINTS)
    port = PortSettings(interface="virtual", channel="brachium-out")
    settings = service.CanSettings(endpoint=endpoint, room="out", port=port, joints=table)
    dbc = database.load_file(Path(service.__file__).with_name("brachium_arm.dbc"))
    elbow = dbc.get_message_by_name("RightElbowFlexion")
    with Bus.open(endpoint) as bus, can.Bus(interface="virtual", channel="brachium-out") as wire:

        def next_elbow() -> dict[str, object]:
            while (frame := wire.recv(WITHIN_S)) is not None:
                if frame.arbitration_id == elbow.frame_id:
                    return elbow.decode(bytes(frame.data))
            raise AssertionError("no frames")

        with running(settings):
            assert str(next_elbow()["Reason"]) == "silent"
            alive = [int(next_elbow()["Alive"]) for _ in range(20)]
            assert all((b - a) % 16 == 1 for a, b in pairwise(alive))
            with moving_arm(bus, "out"):
                until(lambda: next_elbow()["Valid"])
                values: list[dict[str, object]] = []
                until(lambda: values.extend(v for v in (next_elbow(),) if v["Valid"]) or len(values) >= 20)
                for value in values:
                    assert value["Speed"] == pytest.approx(1.0, abs=0.01)
                assert values[-1]["Angle"] > values[0]["Angle"]
            until(lambda: str(next_elbow()["Reason"]) == "silent")
            assert all(not next_elbow()["Valid"] for _ in range(20))


def test_an_emulated_arm_is_refused_in_frames_of_can_fd(endpoint: str, tmp_path: Path):
    table = tmp_path / "joints.toml"
    table.write_text(JOINTS)
    port = PortSettings(interface="virtual", channel="brachium-fd", fd=True)
    settings = service.CanSettings(endpoint=endpoint, room="fd", port=port, joints=table)
    dbc = database.load_file(Path(service.__file__).with_name("brachium_arm.dbc"))
    message = dbc.get_message_by_name("RightArm")
    with Bus.open(endpoint) as bus, can.Bus(interface="virtual", channel="brachium-fd") as wire:

        def next_reason() -> str:
            frame = wire.recv(WITHIN_S)
            assert frame is not None
            assert (frame.arbitration_id, frame.is_fd, len(frame.data)) == (message.frame_id, True, 64)
            read = message.decode(bytes(frame.data))
            assert not read["ElbowFlexionValid"]
            return str(read["ElbowFlexionReason"])

        with running(settings), moving_arm(bus, "fd", "emulated"):
            until(lambda: next_reason() == "origin")


def test_a_frame_alike_in_every_bit_is_a_strangers_when_it_comes_once_more_than_it_went_out():
    ids = OwnIds(range(0x300, 0x309), echoes=True)
    ids.sent(0x300, b"alike")
    came = [ids.is_strange(0x300, b"alike") for _ in range(2)]
    assert came == [False, True]
    assert not ids.is_strange(0x310, b"other arm")
    silent = OwnIds(range(0x300, 0x309), echoes=False)
    silent.sent(0x300, b"alike")
    assert silent.is_strange(0x300, b"alike")


def ended(settings: service.CanSettings, stop: threading.Event) -> str:
    """Run until it ends by itself; return why."""
    with pytest.raises(OtherSender) as found:
        service.run(settings, stop)
    return str(found.value)


@pytest.mark.parametrize(
    "port",
    [
        PortSettings(interface="virtual", channel="brachium-two"),
        PortSettings(
            interface="udp_multicast", channel="239.74.163.9", port=43119
        ),  # gives back what it sends
    ],
    ids=lambda port: port.interface,
)
def test_a_second_sender_of_one_arm_sends_nothing_and_a_stranger_on_its_ids_ends_the_first(
    endpoint: str, tmp_path: Path, port: PortSettings
):
    table = tmp_path / "joints.toml"
    table.write_text(JOINTS)
    settings = service.CanSettings(endpoint=endpoint, room="two", port=port, joints=table)
    stop = threading.Event()
    said: list[str] = []
    going = threading.Thread(target=lambda: said.append(ended(settings, stop)))
    with can.Bus(**port.words()) as wire:
        going.start()
        try:
            until(lambda: wire.recv(WITHIN_S))
            second = ended(settings, threading.Event())
            assert "sends 0x30" in second
            assert "right arm of p01" in second
            assert "base_id" in second
            while wire.recv(0.0):
                pass
            assert wire.recv(WITHIN_S) is not None  # the first goes on
            assert said == []
            wire.send(can.Message(arbitration_id=0x306, data=bytes(8), is_extended_id=False))
            going.join(WITHIN_S)
        finally:
            stop.set()
            going.join(WITHIN_S)
    assert "sends 0x306" in said[0]


def test_an_interface_that_is_not_there_is_one_line():
    with pytest.raises(NoInterface, match=r"socketcan nowhere0 cannot be opened: .*ip link set nowhere0 up"):
        Port(PortSettings(channel="nowhere0"))


def test_an_interface_that_goes_away_is_counted_and_opened_again(caplog: pytest.LogCaptureFixture):
    port = Port(PortSettings(interface="virtual", channel="brachium-gone"))
    assert port.send(0x123, bytes(8))
    port._bus.shutdown()  # as when its cable is drawn
    assert not port.send(0x123, bytes(8))
    assert port.counts["interface_gone"] == 1
    assert "is gone" in caplog.text
    assert not port.send(0x123, bytes(8))
    until(lambda: port.receive(0.01) is None and port.there)
    assert port.send(0x123, bytes(8))
    assert (port.counts["interface_back"], port.counts["not_sent"]) == (1, 2)
    port.close()


def test_a_controller_that_left_the_bus_is_counted():
    port = Port(PortSettings(interface="virtual", channel="brachium-off"))
    with can.Bus(interface="virtual", channel="brachium-off") as wire:
        wire.send(can.Message(arbitration_id=0x40, is_error_frame=True, data=bytes(8)))
        wire.send(can.Message(arbitration_id=0x04, is_error_frame=True, data=bytes(8)))
        wire.send(can.Message(arbitration_id=0x04, is_remote_frame=True))
        assert [port.receive(1.0) for _ in range(3)] == [None, None, None]
    assert +port.counts == {"bus_off": 1, "error_frames": 1, "remote_frames": 1}
    port.close()
