"""The rules for trackers, without a socket: who joins, when samples were taken, what silence means."""

import struct

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from brachium_nodes.roster import Roster
from brachium_nodes.slimevr import answers
from brachium_nodes.slimevr.actions import Joined, Left, Publish, Send, Told
from brachium_nodes.slimevr.allowed import Allowed, AllowList, from_node, from_text
from brachium_nodes.slimevr.tracker import BUNDLED_NS
from brachium_nodes.slimevr.trackers import NO_TOKEN, Trackers
from brachium_wire.messages import Info, SampleBatch, Status
from brachium_wire.samples import read_samples

MS, S = 1_000_000, 1_000_000_000
START = 1_790_000_000 * S
MAC = "a1b2c3d4e5f6"
HERE, THERE = ("10.0.0.7", 40000), ("10.0.0.8", 40001)


class Bench:
    """Trackers with a clock that the test moves; a tracker's packets are made by hand."""

    def __init__(self, *assigned: str, other: dict[str, str] | None = None) -> None:
        other = other or {}
        self.roster = Roster((), NO_TOKEN)
        self.trackers = Trackers(AllowList(map(from_text, assigned)), self.roster, "slimevr", other.get)
        self.now = START
        self.number = 0
        self.done: list = []

    def take(self, data: bytes, address=HERE) -> list:
        self.done.append(found := self.trackers.receive(data, address, self.now))
        return found

    def packet(self, kind: int, payload: bytes = b"", *, address=HERE, lose: int = 0) -> list:
        self.number += 1 + lose
        return self.take(struct.pack(">IQ", kind, self.number) + payload, address)

    def handshake(self, mac: str = MAC, *, address=HERE, protocol: int = 22, firmware: bytes = b"1") -> list:
        self.number = 0
        body = struct.pack(">7I", 1, 10, 2, 0, 0, 0, protocol) + bytes([len(firmware)]) + firmware
        return self.take(struct.pack(">IQ", 3, 0) + body + bytes.fromhex(mac), address)

    def info(self, sensor: int = 0, status: int = 1, position: int = 0, mag: int = 0, kind: int = 0) -> list:
        return self.packet(15, struct.pack(">BBBHBBB", sensor, status, 10, mag, 0, position, kind))

    def turn(self, z: float = 0.0, *, sensor: int = 0, lose: int = 0, address=HERE) -> list:
        xyzw = (0.0, 0.0, float(np.sin(z / 2)), float(np.cos(z / 2)))
        return self.packet(17, struct.pack(">BB4fB", sensor, 1, *xyzw, 0), lose=lose, address=address)

    def join(self) -> None:
        self.handshake()
        self.info()

    def wait(self, ns: int) -> list:
        """Let time pass in ticks of 10 ms; the tracker says nothing."""
        actions: list = []
        for _ in range(ns // (10 * MS)):
            self.now += 10 * MS
            actions += self.trackers.tick(self.now)
        return actions


def batches(actions: list) -> list[SampleBatch]:
    return [a.message for a in actions if isinstance(a, Publish) and isinstance(a.message, SampleBatch)]


def of(kind: type, actions: list) -> list:
    return [a for a in actions if isinstance(a, kind)]


@pytest.fixture
def bench() -> Bench:
    one = Bench(f"{MAC}=p01/forearm_r")
    one.join()
    return one


def test_a_named_tracker_is_answered_acknowledged_and_joins():
    bench = Bench(f"{MAC}=p01/forearm_r")
    assert bench.handshake() == [Send(HERE, answers.WELCOME)]
    actions = bench.info()
    assert actions[0] == Send(HERE, answers.known(0, 1))
    assert of(Joined, actions) == [Joined(f"slimevr-{MAC}.0", "p01", "forearm_r")]
    (info,) = [a.message for a in actions if isinstance(a, Publish)]
    assert isinstance(info, Info)
    assert info.mounting == (1.0, 0.0, 0.0, 0.0)
    assert not batches(actions)
    assert bench.packet(22, b"\x02") == [Send(HERE, answers.FEATURES)]


def test_a_magnetometer_gives_a_heading_that_is_not_its_own(bench):
    (info,) = [a.message for a in bench.info(mag=3) if isinstance(a, Publish)]
    assert (info.heading_free, info.magnetometer, info.orientation_only) == (False, False, True)


def test_a_stranger_gets_no_answer_is_listed_once_and_its_samples_are_dropped(bench):
    for _ in range(3):
        assert bench.handshake("00112233445566"[:12], address=THERE) == []
    assert bench.roster.waiting == ["slimevr-001122334455.0"]
    assert bench.turn(address=THERE) == []
    assert bench.trackers.drops["stranger"] == 4
    assert bench.handshake("000000000000", address=THERE) == []
    assert bench.trackers.drops["no_mac"] == 1


def test_where_no_segment_is_given_the_tracker_says_where_it_is_worn():
    bench = Bench(f"{MAC}=p01")
    bench.handshake()
    assert of(Joined, bench.info(0, position=16)) == [Joined(f"slimevr-{MAC}.0", "p01", "upper_arm_r")]
    assert of(Joined, bench.info(1, position=14)) == [Joined(f"slimevr-{MAC}.1", "p01", "forearm_r")]
    assert of(Joined, bench.info(2, position=0)) == []
    assert of(Joined, bench.info(3, position=9)) == []  # a leg
    assert bench.roster.waiting == [f"slimevr-{MAC}.2", f"slimevr-{MAC}.3"]


def test_a_segment_that_is_given_goes_before_what_the_tracker_says():
    bench = Bench(f"{MAC}/1=p01/hand_l")
    bench.handshake()
    assert of(Joined, bench.info(1, position=14)) == [Joined(f"slimevr-{MAC}.1", "p01", "hand_l")]
    assert of(Joined, bench.info(0, position=14)) == []


def test_an_old_tracker_has_one_sensor_without_telling_of_it():
    bench = Bench(f"{MAC}=p01/forearm_r")
    assert of(Joined, bench.handshake(protocol=8))
    xyzw = struct.pack(">4f", 0.0, 0.0, 0.0, 1.0)
    assert len(batches(bench.packet(1, xyzw))) == 1
    other = Bench(f"{MAC}=p01/forearm_r")
    assert of(Joined, other.handshake(firmware=b""))


@pytest.mark.parametrize(("status", "kind"), [(0, 0), (2, 0), (1, 1)])
def test_a_sensor_that_is_off_broken_or_no_orientation_sensor_does_not_join(status, kind):
    bench = Bench(f"{MAC}=p01/forearm_r")
    bench.handshake()
    actions = bench.info(status=status, kind=kind)
    assert actions == [Send(HERE, answers.known(0, status))]
    assert of(Joined, bench.info())  # until it works


def test_a_sensor_that_breaks_leaves(bench):
    (left,) = of(Left, bench.info(status=2))
    assert left.node == f"slimevr-{MAC}.0"
    assert batches(bench.turn()) == []
    assert bench.trackers.drops["no_segment"] == 1


def test_a_subject_of_another_host_is_refused_and_tried_again():
    other = {"p01": "gateway"}
    bench = Bench(f"{MAC}=p01/forearm_r", other=other)
    bench.handshake()
    actions = bench.info()
    assert "comes in through host gateway" in of(Told, actions)[0].text
    assert batches(bench.turn()) == []
    other.clear()
    answered = []
    for _ in range(11):
        answered += bench.wait(500 * MS)
        bench.packet(0)
    assert of(Joined, answered)


def test_two_sensors_for_one_segment_the_first_stays():
    bench = Bench(f"{MAC}=p01")
    bench.handshake()
    assert of(Joined, bench.info(0, position=14))
    actions = bench.info(1, position=14)
    assert of(Joined, actions) == []
    assert "is held by node" in of(Told, actions)[0].text
    bench.info(0, status=0)
    assert of(Joined, bench.info(1, position=14))


# -- time ------------------------------------------------------------------------------------------------


def test_before_a_ping_came_back_the_arrival_is_the_time_and_the_doubt_is_large(bench):
    (batch,) = batches(bench.turn())
    assert batch.time_ns == bench.now == batch.received_ns
    assert batch.uncertainty_ns == 50 * MS


def test_half_the_round_trip_is_taken_off_and_the_doubt_covers_all_that_may_have_been(bench):
    (ping,) = [a.data for a in bench.trackers.tick(bench.now) if isinstance(a, Send) and a.data[3] == 10]
    bench.now += 8 * MS
    bench.take(ping)
    bench.now += 2 * MS
    (batch,) = batches(bench.turn())
    assert batch.time_ns == bench.now - 4 * MS
    # kept for up to 10 ms, then on its way for up to the whole round trip
    assert batch.uncertainty_ns == BUNDLED_NS + 8 * MS - 4 * MS
    bench.take(ping)
    bench.take(answers.ping(999))
    assert bench.trackers.drops["unasked_ping"] == 2


@given(st.lists(st.tuples(st.integers(0, 30 * MS), st.booleans(), st.integers(0, 40 * MS)), max_size=60))
def test_times_grow_and_never_lie_behind_the_arrival_by_more_than_is_stated(steps):
    bench, newest, sequence = Bench(f"{MAC}=p01/forearm_r"), 0, -1
    bench.join()
    pings: list[bytes] = []
    for wait_ns, answer, _ in steps:
        bench.now += wait_ns
        pings += [a.data for a in bench.trackers.tick(bench.now) if isinstance(a, Send) and a.data[3] == 10]
        if answer and pings:
            bench.take(pings.pop())
        for batch in batches(bench.turn(0.01 * bench.number)):
            samples = read_samples(batch)
            assert samples.time_ns[0] > newest
            assert samples.time_ns[-1] <= batch.received_ns + 60_000  # 1 us a sample when many come at once
            assert batch.sequence == sequence + 1
            newest, sequence = samples.time_ns[-1], batch.sequence + len(samples) - 1


def test_several_samples_of_one_datagram_are_a_period_apart(bench):
    inner = struct.pack(">I", 17) + struct.pack(">BB4fB", 0, 1, 0.0, 0.0, 0.0, 1.0, 0)
    bench.turn()
    bench.now += 100 * MS
    (batch,) = batches(bench.packet(100, 3 * (struct.pack(">H", len(inner)) + inner)))
    assert np.diff(read_samples(batch).time_ns).tolist() == [10 * MS, 10 * MS]


# -- loss ------------------------------------------------------------------------------------------------


def test_lost_datagrams_are_counted_and_shown_as_missing_samples(bench):
    for _ in range(10):
        bench.turn()
    (batch,) = batches(bench.turn(lose=3))
    assert batch.sequence == 13
    status = last_status(bench.wait(1100 * MS))
    assert (status.received, status.lost) == (11, 3)
    assert bench.trackers.counts["datagrams_lost"] == 3


def last_status(actions: list) -> Status:
    return [a.message for a in actions if isinstance(a, Publish) and isinstance(a.message, Status)][-1]


def test_of_datagrams_that_carry_other_things_too_only_a_part_is_missing_samples(bench):
    acceleration = struct.pack(">3fB", 0.0, 0.0, 0.0, 0)
    for _ in range(500):
        bench.turn()
        bench.packet(4, acceleration)
    bench.packet(4, acceleration, lose=100)
    status = last_status([*bench.turn(), *bench.wait(1100 * MS)])
    assert status.lost == pytest.approx(50, abs=5)


def test_what_a_later_datagram_overtook_is_dropped(bench):
    bench.turn()
    bench.turn(lose=1)
    bench.number -= 2
    assert bench.turn() == []
    assert bench.trackers.drops["out_of_order"] == 1
    bench.number = 2**64 - 2
    assert bench.turn() == []  # a number that cannot be takes nothing from what comes after it
    bench.number = 4
    assert len(batches(bench.turn())) == 1


# -- silence ---------------------------------------------------------------------------------------------


def heartbeats(actions: list) -> int:
    return sum(isinstance(a, Send) and a.data == answers.HEARTBEAT for a in actions)


def test_a_tracker_that_moves_is_asked_twice_a_second_and_one_that_rests_more_often(bench):
    asked = 0
    for _ in range(100):
        bench.turn()
        asked += heartbeats(bench.wait(10 * MS))
    assert asked in (2, 3)
    assert heartbeats(bench.wait(1000 * MS)) in range(18, 22)


def test_at_rest_every_answer_brings_the_samples_since_the_last(bench):
    bench.turn(0.5)
    count = 0
    for _ in range(20):
        asked = heartbeats(bench.wait(50 * MS))
        found = [b for _ in range(asked) for b in batches(bench.packet(0))]
        for batch in found:
            samples = read_samples(batch)
            assert samples.quat is not None
            assert samples.quat[0] == pytest.approx([np.cos(0.25), 0.0, 0.0, np.sin(0.25)], abs=1e-6)
            assert set(np.diff(samples.time_ns)) <= {10 * MS}
            count += len(samples)
    assert 95 <= count <= 100
    status = last_status(bench.wait(1100 * MS))
    assert (status.received, status.lost) == (1 + count, 0)


def test_without_an_answer_nothing_is_invented(bench):
    bench.turn()
    assert batches(bench.wait(900 * MS)) == []


def test_a_rotation_may_have_been_lost_then_rest_is_not_known(bench):
    bench.turn()
    bench.wait(10 * MS)
    asked = heartbeats(bench.wait(100 * MS))
    assert asked > 0
    found = [b for i in range(asked) for b in batches(bench.packet(0, lose=5 if i == 0 else 0))]
    assert found == []  # more was lost than answers
    bench.turn()
    bench.wait(100 * MS)
    assert batches(bench.packet(0)) != []


def test_a_lost_answer_alone_does_not_hide_that_a_tracker_rests(bench):
    bench.turn()
    bench.wait(200 * MS)
    assert batches(bench.packet(0, lose=1)) != []


def test_a_tracker_that_comes_anew_does_not_rest_where_it_was(bench):
    bench.turn(0.5)
    bench.wait(100 * MS)
    bench.handshake(address=THERE)
    bench.wait(100 * MS)
    assert batches(bench.packet(0, address=THERE)) == []
    assert bench.turn() == []  # its old address is a stranger's now
    (batch,) = batches(bench.turn(address=THERE))
    assert batch.sequence == 1


def test_after_three_seconds_of_silence_it_is_gone_and_says_so(bench):
    bench.turn()
    actions = bench.wait(3200 * MS)
    (left,) = of(Left, actions)
    assert left.subject == "p01"
    assert not last_status(actions).connected
    assert bench.trackers.connected == 0
    assert bench.trackers.subjects == set()
    bench.join()
    assert batches(bench.turn())[0].sequence == 1


def test_whoever_gives_way_says_a_last_status_for_that_subject_only():
    bench = Bench(f"{MAC}/0=p01/forearm_r", f"{MAC}/1=p02/forearm_r")
    bench.handshake()
    bench.info(0)
    bench.info(1)
    (left,) = of(Left, bench.trackers.expel(bench.now, "because", subject="p02"))
    assert left.subject == "p02"
    assert bench.trackers.subjects == {"p01"}


def test_assigned_elsewhere_it_leaves_and_joins_there(bench):
    node = f"slimevr-{MAC}.0"
    bench.trackers.allowed.add(from_node(node, "p02", "hand_l", None))
    actions = bench.trackers.reassign(node, bench.now)
    assert of(Left, actions)[0].subject == "p01"
    assert of(Joined, actions) == [Joined(node, "p02", "hand_l")]


# -- the list --------------------------------------------------------------------------------------------


def test_assignments_are_read_as_they_are_written():
    assert from_text("A1-B2-C3-D4-E5-F6/2=p01/hand_l") == Allowed(
        mac="A1-B2-C3-D4-E5-F6", sensor=2, subject="p01", segment="hand_l"
    )
    listed = AllowList([from_text("A1:b2:C3:d4:E5:f6=p01/hand_l")])
    assert MAC in listed
    assert listed.of(MAC, 1, 14) is None
    assert "001122334455" not in listed


@pytest.mark.parametrize(
    ("texts", "says"),
    [
        (["a1b2c3d4e5f6"], "assigns no tracker"),
        (["a1b2c3d4e5f6/x=p01/hand_l"], "assigns no tracker"),
        (["a1b2c3d4e5f6=p01/"], "assigns no tracker"),
        (["a1b2c3d4e5=p01/hand_l"], "no MAC address"),
        (["a1b2c3d4e5f6=p01/elbow"], "choose one of sternum"),
        (["a1b2c3d4e5f6=service/hand_l"], "service"),
        (["a1b2c3d4e5f6=/hand_l"], "subject"),
        (["a1b2c3d4e5f6/77=p01/hand_l"], "sensors 0 to 15"),
        (["a1b2c3d4e5f6=p01/hand_l", "A1:B2:C3:D4:E5:F6/0=p01/hand_r"], "assigned twice"),
        (["a1b2c3d4e5f6=p01/hand_l", "001122334455=p01/hand_l"], "is given to"),
        (["a1b2c3d4e5f6=p01", "a1b2c3d4e5f6=p02"], "assigned twice"),
    ],
)
def test_what_assigns_nothing_sound_is_refused_with_what_to_write(texts, says):
    with pytest.raises(ValueError, match=says):
        AllowList(map(from_text, texts))


@pytest.mark.parametrize("node", ["esp-1", "slimevr-a1b2c3d4e5f6", "slimevr-zz.0"])
def test_a_node_that_is_no_tracker_is_not_added(node):
    with pytest.raises(ValueError, match=r"SlimeVR|MAC"):
        AllowList().add(from_node(node, "p01", "hand_l", None))
