"""SlimeVR trackers that know nothing of us, as processes of their own, through router, service and fusion."""

import json
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from brachium.checks import free_port
from brachium.processes import Processes
from brachium_wire import keys
from brachium_wire.bus import Bus
from brachium_wire.codec import decode_topic, encode
from brachium_wire.messages import Calibration, Event, Health, Info, SampleBatch, Session, Skeleton, Status
from brachium_wire.samples import read_samples

pytestmark = pytest.mark.network

TRACKER = Path(__file__).parent.parent / "outside" / "slimevr_tracker.py"
ARM, TRUNK, STRANGER = "a1b2c3d4e5f6", "00:11:22:33:44:55", "dead00beef01"
LEFT_LOWER_ARM, RIGHT_LOWER_ARM, RIGHT_UPPER_ARM, RIGHT_HAND = 13, 14, 16, 18
WITHIN_S = 60.0

NEUTRAL = Rotation.from_matrix(np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]))
"""World from segment of a right arm that hangs, the wearer facing +y: X forward, Y up, Z to the right."""


class Room:
    """All that was said in the room, by topic, as it came."""

    def __init__(self, bus: Bus) -> None:
        self._inbox = bus.subscribe(keys.everything("lab"))
        self.said: dict[tuple[str, str], list] = {}

    def of(self, topic: str, detail: str = "") -> list:
        for key, payload in self._inbox.drain():
            parsed = keys.parse(key)
            self.said.setdefault((parsed.topic, parsed.detail), []).append(
                decode_topic(payload, parsed.topic)
            )
        return self.said.get((topic, detail), [])

    def health(self) -> Health:
        said = self.of("health", "slimevr/slimevr")
        return said[-1] if said else Health(kind="", id="", time_ns=0, uptime_s=0.0)


def until(condition: Callable[[], object], what: str) -> None:
    deadline, pause = time.monotonic() + WITHIN_S, threading.Event()
    while not condition():
        assert time.monotonic() < deadline, f"waited {WITHIN_S:g} s for: {what}"
        pause.wait(0.02)


class Tracker:
    """A tracker's process, what it is told and what it tells."""

    def __init__(self, port: int, mac: str, positions: list[int], *more: str) -> None:
        words = [
            sys.executable,
            str(TRACKER),
            "127.255.255.255",
            str(port),
            mac,
            json.dumps(positions),
            *more,
        ]
        self._process = subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        self.told: list[dict] = []
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            self.told.append(json.loads(line))

    def order(self, **what: object) -> None:
        assert self._process.stdin is not None
        self._process.stdin.write(json.dumps(what) + "\n")
        self._process.stdin.flush()

    def play(self, frames: list[dict[int, Rotation]]) -> None:
        """Let it measure these, one each 10 ms, and wait until it did."""
        played = self.times("played")
        self.order(frames=[{s: turn.as_quat().tolist() for s, turn in frame.items()} for frame in frames])
        until(lambda: self.times("played") > played, "the frames to be played")

    def times(self, what: str) -> int:
        return sum(what in one for one in self.told)

    def end(self) -> None:
        self._process.kill()
        self._process.communicate()


@pytest.fixture(scope="module")
def network() -> Iterator[tuple[str, int]]:
    """Router, fusion and the door for trackers, each a process; the endpoint and the door's port."""
    with Processes() as processes:
        port, door = free_port(), free_port()
        endpoint = f"tcp/127.0.0.1:{port}"
        processes.start("router", ["router", "--port", str(port)])
        with Bus.open(endpoint) as bus:
            for subject in ("p01", "p02"):
                bus.retain(keys.session("lab", subject), encode(Session(height_m=1.75)))
            processes.start("fuse", ["fuse", "--endpoint", endpoint, "--no-keep"])
            assigned = (f"{ARM}=p01", f"{TRUNK}/1=p02/hand_l", f"{TRUNK}=p02/forearm_l")
            words = [word for one in assigned for word in ("--assign", one)]
            processes.start("slimevr", ["slimevr", "--endpoint", endpoint, "--port", str(door), *words])
            until(lambda: bus.alive(keys.alive("lab", "slimevr", "slimevr")), "the door")
            until(lambda: bus.alive(keys.services("lab", "fusion/*/alive")), "fusion")
            yield endpoint, door


@pytest.fixture
def bus(network: tuple[str, int]) -> Iterator[Bus]:
    with Bus.open(network[0]) as bus:
        yield bus


@pytest.fixture
def room(bus: Bus) -> Room:
    return Room(bus)


@pytest.fixture
def tracker(network: tuple[str, int]) -> Iterator[Callable[..., Tracker]]:
    started: list[Tracker] = []

    def start(mac: str, positions: list[int], *more: str) -> Tracker:
        started.append(Tracker(network[1], mac, positions, *more))
        return started[-1]

    yield start
    for one in started:
        one.end()


def heading(deg: float) -> Rotation:
    return Rotation.from_euler("z", deg, degrees=True)


def elbow(deg: float) -> Rotation:
    """A right forearm flexed so far, seen from where it hung: positive about Z, which points to the right."""
    return NEUTRAL * Rotation.from_euler("z", deg, degrees=True)


def test_a_tracker_moves_its_own_segments_each_with_a_heading_of_its_own(tracker, room):
    arm = tracker(ARM, [RIGHT_UPPER_ARM, RIGHT_LOWER_ARM, RIGHT_HAND], "--bundle")
    until(lambda: arm.times("acked") == 3, "the sensors to be known")
    assert arm.times("joined") == 1
    until(lambda: arm.times("features"), "the features")
    turned = [heading(150.0), heading(-70.0), heading(20.0)]

    def frame(flexion: float) -> dict[int, Rotation]:
        return {0: turned[0] * NEUTRAL, 1: turned[1] * elbow(flexion), 2: turned[2] * elbow(flexion)}

    arm.play([frame(0.0)])  # and nothing more: it rests, and says so when it is asked
    until(lambda: done(room), "the pose of 3 s at rest")
    assert done(room)[-1].forward == "mounting"
    arm.play([frame(deg) for deg in np.linspace(0.0, 90.0, 100)])
    until(lambda: flexed(room), "the elbow to flex")
    last = flexed(room)[-1]
    deg = {name: np.degrees(angle) for name, angle in last.angles.items()}
    assert deg["elbow_flexion"] == pytest.approx(90.0, abs=1.0)
    for name in (
        "shoulder_flexion",
        "shoulder_abduction",
        "forearm_pronation",
        "wrist_flexion",
        "wrist_deviation",
    ):
        assert deg[name] == pytest.approx(0.0, abs=1.0), name
    assert last.shoulder_shift is None
    assert "shoulder" in last.positions
    assert last.origin == "worn"
    path = [s.angles["elbow_flexion"] for s in room.of("skeleton", "right") if "elbow_flexion" in s.angles]
    assert sum(0.1 < flexion < 1.5 for flexion in path) > 20  # 50 Hz over the second, or more, that it took


def flexed(room: Room) -> list[Skeleton]:
    """Every arm that is bent all the way, all of it measured."""
    return [
        s
        for s in room.of("skeleton", "right")
        if s.angles.get("elbow_flexion", 0.0) > 1.565
        and all(p.quality == "good" for p in s.segments.values())
    ]


def done(room: Room) -> list[Calibration]:
    return [c for c in room.of("calibration") if c.state == "done"]


def test_what_comes_is_said_to_be_orientation_alone_with_a_heading_of_its_own(tracker, room):
    one = tracker(TRUNK, [0, 0])
    until(lambda: one.times("acked") == 2, "the sensors to be known")
    one.play([{0: NEUTRAL, 1: elbow(deg)} for deg in range(50)])
    until(lambda: len(moved(room, "hand_l")) >= 50, "the samples")
    info: Info = room.of("info", "hand_l")[-1]
    assert (info.node, info.chip, info.firmware) == ("slimevr-001122334455.1", "ICM-42688", "0.5.4")
    assert (info.orientation_only, info.heading_free, info.magnetometer) == (True, True, False)
    assert (info.origin, info.host, info.rate_hz) == ("worn", "slimevr", 100.0)
    batches: list[SampleBatch] = room.of("imu", "hand_l")
    assert all(b.acc is None and b.gyr is None and b.quat is not None for b in batches)
    assert all(b.time_ns <= b.received_ns and b.uncertainty_ns >= 10_000_000 for b in batches)
    times = [t for b in batches for t in read_samples(b).time_ns]
    assert times == sorted(set(times))
    for deg, turn in enumerate(moved(room, "hand_l")):
        told = Rotation.from_quat(turn, scalar_first=True)
        assert (told.inv() * elbow(deg)).magnitude() < 1e-6


def moved(room: Room, segment: str) -> list[np.ndarray]:
    """Orientations but for those that say that it rested, as while a busy machine holds datagrams."""
    every = samples(room, segment)
    before = [None, *every[:-1]]
    return [now for last, now in zip(before, every, strict=True) if not np.array_equal(last, now)]


def samples(room: Room, segment: str) -> list[np.ndarray]:
    """Every orientation of a segment, scalar first, in the order in which it came."""
    found = [read_samples(b).quat for b in room.of("imu", segment)]
    return [row for quat in found if quat is not None for row in quat]


def test_battery_signal_tap_and_loss_are_told(tracker, room):
    one = tracker(TRUNK, [0, 0])
    until(lambda: one.times("acked") == 2, "the sensors to be known")
    one.order(send=[12, np.array([3.75, 0.5], dtype=">f4").tobytes().hex()])
    one.order(send=[19, "ffc4"])  # -60 dBm
    one.order(send=[13, "0102"])
    one.order(send=[20, "0041a00000"])  # 20 degrees, of no use here
    one.order(send=[99, "00"])
    one.play([{0: elbow(deg)} for deg in range(60)])
    one.order(lose=20)  # rotation and acceleration of ten samples
    one.play([{0: elbow(deg)} for deg in range(60, 120)])
    until(lambda: [e for e in room.of("event") if e.kind == "tap"], "the tap")
    tap: Event = room.of("event")[-1]
    assert tap.data == {"segment": "hand_l", "node": "slimevr-001122334455.1", "value": 2}
    until(lambda: (said := statuses(room, "forearm_l")) and said[-1].lost and said[-1].rssi_dbm, "the status")
    status = statuses(room, "forearm_l")[-1]
    assert (status.battery_v, status.battery_level, status.rssi_dbm) == (3.75, 0.5, -60.0)
    assert 5 <= status.lost <= 20
    assert status.clock_uncertainty_ns is not None
    assert status.clock_uncertainty_ns >= 10_000_000
    until(lambda: room.health().counts.get("datagrams_lost", 0) >= 20, "the lost datagrams to be counted")
    until(lambda: room.health().drops.get("unknown_packet", 0) >= 1, "the unknown packet to be counted")
    sequences = [b.sequence for b in room.of("imu", "forearm_l")]
    assert sequences == sorted(set(sequences))


def statuses(room: Room, segment: str) -> list[Status]:
    return room.of("status", segment)


def test_a_stranger_is_not_answered_and_is_shown_as_waiting(tracker, room, bus):
    one = tracker(STRANGER, [LEFT_LOWER_ARM])
    until(lambda: f"slimevr-{STRANGER}.0" in room.health().waiting, "the stranger to be shown")
    assert one.told == []
    one.order(bytes=rotation_datagram(7))  # who is not answered may still send
    before = room.health().drops["stranger"]
    until(lambda: room.health().drops["stranger"] > before + 2, "more of the stranger")
    assert one.told == []
    assert not bus.alive(keys.services("lab", f"node/slimevr-{STRANGER}.0/alive"))


def rotation_datagram(number: int) -> str:
    header = np.array([17], dtype=">u4").tobytes() + np.array([number], dtype=">u8").tobytes()
    return (header + bytes([0, 1]) + np.array([0, 0, 0, 1], dtype=">f4").tobytes() + b"\0").hex()


def test_a_tracker_that_restarts_goes_on_and_one_that_stops_leaves_a_gap(tracker, room, bus):
    one = tracker(TRUNK, [0, 0])
    token = keys.alive("lab", "node", "slimevr-001122334455.0")
    until(lambda: one.times("acked") == 2, "the sensors to be known")
    one.play([{0: elbow(deg)} for deg in range(30)])
    one.order(restart=True)
    until(lambda: one.times("joined") == 2, "the tracker to be back")
    until(lambda: one.times("acked") == 4, "its sensors to be known")
    assert bus.alive(token)
    one.play([{0: elbow(deg)} for deg in range(30, 60)])
    until(
        lambda: any(np.allclose(turned(row), 59.0) for row in samples(room, "forearm_l")), "the last sample"
    )
    sequences = [b.sequence for b in room.of("imu", "forearm_l")]
    assert sequences == sorted(set(sequences))
    one.order(mute=True)
    until(lambda: not bus.alive(token), "the token's end")
    until(lambda: not statuses(room, "forearm_l")[-1].connected, "the last status")
    newest = room.of("imu", "forearm_l")[-1]
    assert (
        newest.received_ns < statuses(room, "forearm_l")[-1].time_ns - 2_500_000_000
    )  # nothing was invented
    one.order(mute=False)
    until(lambda: bus.alive(token), "the token again")


def turned(row: np.ndarray) -> float:
    """How far a forearm is flexed, deg."""
    return float(np.degrees((NEUTRAL.inv() * Rotation.from_quat(row, scalar_first=True)).magnitude()))


def test_a_second_tracker_for_a_taken_segment_waits(tracker, room):
    first = tracker(ARM, [RIGHT_LOWER_ARM, RIGHT_LOWER_ARM])  # both sensors say that they are worn there
    until(lambda: first.times("acked") == 2, "the sensors to be known")
    until(lambda: room.health().counts.get("refused"), "the second to be refused")
    first.play([{0: elbow(1.0 * deg), 1: elbow(-1.0 * deg)} for deg in range(1, 40)])
    until(lambda: any(turned(row) > 38.0 for row in samples(room, "forearm_r")), "the first one's samples")
    signs = {
        round(Rotation.from_quat(row, scalar_first=True).as_matrix()[1, 1], 6) >= 0
        for row in samples(room, "forearm_r")
    }
    assert len(signs) == 1
    until(lambda: room.health().drops.get("no_segment", 0) >= 39, "the second one's samples to be dropped")


def test_a_stranger_that_is_assigned_by_command_comes_in_beside_a_running_gateway(
    tracker, room, network, processes, brachium
):
    endpoint, _ = network
    processes.start("gateway", ["gateway", "--endpoint", endpoint, "--port", "0", "--discovery-port", "0"])
    until(lambda: room.of("health", "gateway/gateway"), "the gateway")
    one = tracker("0badc0ffee00", [0])
    node = "slimevr-0badc0ffee00.0"
    until(lambda: node in room.health().waiting, "the stranger to be shown")
    done = brachium("gateway", "--endpoint", endpoint, "--assign", f"{node}=p03/upper_arm_l")
    assert (done.returncode, done.stdout) == (0, f"{node} is now upper_arm_l of p03\n"), done.stderr
    until(lambda: one.times("joined"), "the tracker to be answered")
    until(lambda: one.times("acked"), "its sensor to be known")
    one.play([{0: elbow(deg)} for deg in range(20)])
    until(lambda: samples(room, "upper_arm_l"), "its samples")
    until(lambda: node not in room.health().waiting, "the stranger to wait no more")
    refused = brachium("gateway", "--endpoint", endpoint, "--assign", "slimevr-zz.0=p03/hand_l")
    assert (refused.returncode, "no MAC address" in refused.stderr) == (1, True)
