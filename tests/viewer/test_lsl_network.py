"""Real LSL streams on loopback: what another LSL program finds, and what it brings back."""

import math
import threading
import time
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest

from brachium_viewer.lsl.library import NoLsl, load
from brachium_viewer.lsl.lsl_clock import compare
from brachium_viewer.lsl.service import LslSettings, run
from brachium_wire import keys
from brachium_wire.bus import Bus
from brachium_wire.codec import decode_topic, encode
from brachium_wire.hosttime import HostClock, tell_host_time
from brachium_wire.messages import Event, Health, Info, SegmentPose, Skeleton
from brachium_wire.samples import write_samples

pytestmark = pytest.mark.network

WITHIN_S = 60.0
HOUR_NS = 3_600_000_000_000


def until(condition: Callable[[], Any], what: str) -> Any:
    deadline, pause = time.monotonic() + WITHIN_S, threading.Event()
    while not (found := condition()):
        assert time.monotonic() < deadline, f"waited {WITHIN_S:g} s for: {what}"
        pause.wait(0.02)
    return found


@pytest.fixture(scope="module")
def pylsl() -> Any:
    try:
        return load("machine")
    except (ModuleNotFoundError, NoLsl) as error:
        pytest.skip(f"LSL is not there: {error}")


class Lab:
    """A room with one sensor and one arm of a subject, and the service that streams it."""

    def __init__(self, endpoint: str, room: str, pylsl: Any) -> None:
        self.room, self.pylsl, self.stop = room, pylsl, threading.Event()
        self.bus = Bus.open(endpoint)
        self.clock = HostClock(time.time_ns() - time.monotonic_ns() - 12 * HOUR_NS)
        """A host whose time is none that this machine would tell by itself."""
        tell_host_time(self.bus, room, "gw", lambda: self.clock.now_ns())
        self._inbox = self.bus.subscribe(keys.everything(room))
        self.events: list[Event] = []
        self.health = Health(kind="", id="", time_ns=0, uptime_s=0.0)
        self.inform()
        settings = LslSettings(endpoint=endpoint, room=room)
        self._thread = threading.Thread(target=run, args=(settings, self.stop))
        self._thread.start()
        until(self.listen, "the service")
        self._sequence = 0

    def listen(self) -> bool:
        for key, payload in self._inbox.drain():
            message = decode_topic(payload, keys.parse(key).topic)
            if isinstance(message, Event):
                self.events.append(message)
            elif isinstance(message, Health) and message.kind == "lsl":
                self.health = message
        return bool(self.health.kind)

    def inform(self, **more: Any) -> None:
        said = {"node": "n", "rate_hz": 100.0, "origin": "worn", "host": "gw", "chip": "MPU-9150"} | more
        self.bus.retain(keys.info(self.room, "p01", "hand_r"), encode(Info(**said)))

    def samples(self, times_ns: list[int], acc: Any, *, late: bool = False) -> None:
        batch = write_samples(
            sequence=self._sequence,
            time_ns=times_ns,
            device_us=range(len(times_ns)),
            received_ns=max(times_ns),
            uncertainty_ns=0,
            acc=acc,
            gyr=np.zeros((len(times_ns), 3)),
            late=late,
        )
        self._sequence += len(times_ns)
        self.bus.put(keys.imu(self.room, "p01", "hand_r"), encode(batch))

    def inlet(self, name: str) -> Any:
        """Return an open inlet on the stream of this name in this room."""
        wanted = f"name='{name}' and contains(source_id,':{self.room}:')"
        (info, *_) = until(lambda: self.pylsl.resolve_bypred(wanted, 1, 0.5), f"stream {name}")
        inlet = self.pylsl.StreamInlet(info)
        inlet.open_stream(timeout=WITHIN_S)
        return inlet

    def uncertainty_ns(self, samples: int) -> int:
        """Return how well the service knows this host's time, as it tells after so many samples."""
        until(lambda: self.listen() and self.health.counts.get("samples", 0) >= samples, "the samples' count")
        return self.health.counts["clock_uncertainty_ns_gw"]

    def end(self) -> None:
        self.stop.set()
        self._thread.join(timeout=15.0)
        assert not self._thread.is_alive()
        self.bus.close()


rooms = iter(range(1000))


@pytest.fixture
def lab(endpoint: str, pylsl: Any) -> Iterator[Lab]:
    one = Lab(endpoint, f"lsl{next(rooms)}", pylsl)
    yield one
    one.end()


def pulled(inlet: Any, n: int) -> tuple[np.ndarray, list[float]]:
    """Return n samples and their times."""
    rows: list[list[Any]] = []
    times: list[float] = []

    def enough() -> bool:
        more, at = inlet.pull_chunk(timeout=0.1)
        rows.extend(more)
        times.extend(at)
        return len(times) >= n

    until(enough, f"{n} samples")
    return np.array(rows), times


def test_samples_come_with_our_time_in_lsls_clock_their_labels_and_nothing_behind_time(lab: Lab, pylsl: Any):
    now = lab.clock.now_ns()
    lab.samples([now], np.zeros((1, 3)))  # the stream is there from the first sample on
    inlet = lab.inlet("p01 hand_r samples")
    said = inlet.info(timeout=WITHIN_S)
    assert said.get_channel_labels() == ["acc_x", "acc_y", "acc_z", "gyr_x", "gyr_y", "gyr_z"]
    assert said.get_channel_units() == ["m/s^2"] * 3 + ["rad/s"] * 3
    assert said.get_channel_types() == ["ACCEL"] * 3 + ["GYRO"] * 3
    assert (said.nominal_srate(), said.type(), said.channel_format()) == (100.0, "IMU", pylsl.cf_float32)
    desc = said.desc()
    assert desc.child("acquisition").child_value("manufacturer") == "Brachium"
    assert desc.child("acquisition").child_value("model") == "MPU-9150"
    assert desc.child("brachium").child_value("origin") == "worn"
    assert desc.child("brachium").child_value("missing_values") == "NaN: not measured"

    start, ours = lab.clock.now_ns(), compare(lab.clock.now_ns, pylsl.local_clock)
    times = [start + 10_000_000 * i for i in range(5)]
    values = np.arange(15.0).reshape(5, 3)
    lab.samples(times, values)
    lab.samples([start - 50_000_000], values[:1], late=True)
    lab.samples([start + 5_000_000], values[:1])  # behind what was sent
    lab.samples([start + 60_000_000], values[:1])
    rows, at = pulled(inlet, 6)
    assert rows[:5, :3].tolist() == values.tolist()
    wanted = [ours.lsl(t) for t in [*times, start + 60_000_000]]
    off_ns = ours.uncertainty_ns + lab.uncertainty_ns(7)
    assert at == pytest.approx(wanted, abs=off_ns * 1e-9 + 1e-6)
    assert np.diff(at[:5]) == pytest.approx([0.01] * 4, abs=1e-6)
    until(lambda: lab.listen() and lab.health.drops.get("time_backwards"), "the drops")
    assert (lab.health.drops["late"], lab.health.drops["time_backwards"]) == (1, 1)


def test_a_skeleton_comes_as_two_streams_with_nan_for_what_was_not_measured(lab: Lab):
    def put(time_ns: int) -> None:
        skeleton = Skeleton(
            time_ns=time_ns,
            side="right",
            origin="emulated",
            forward="none",
            trunk_from_world=(1.0, 0.0, 0.0, 0.0),
            segments={"hand_r": SegmentPose(quality="held", world_from_segment=(0.0, 1.0, 0.0, 0.0))},
            positions={"hand": (0.25, 0.5, -0.75)},
            angles={"wrist_flexion": math.pi / 6},
        )
        lab.bus.put(keys.skeleton(lab.room, "p01", "right"), encode(skeleton))

    put(lab.clock.now_ns())
    inlets = [lab.inlet(f"p01 right {what} (emulated)") for what in ("skeleton", "angles")]
    put(lab.clock.now_ns())
    for inlet, label, value in zip(inlets, ("hand_y", "wrist_flexion"), (0.5, 30.0), strict=True):
        labels = inlet.info(timeout=WITHIN_S).get_channel_labels()
        rows, times = pulled(inlet, 1)
        row = dict(zip(labels, rows[0].tolist(), strict=True))
        assert row[label] == pytest.approx(value)
        assert math.isnan(row["elbow_x" if label == "hand_y" else "elbow_flexion"])
        assert abs(times[0] - lab.pylsl.local_clock()) < WITHIN_S


def test_markers_of_others_become_events_and_events_become_markers_but_not_again(lab: Lab, pylsl: Any):
    info = pylsl.StreamInfo("stimuli", "Markers", 1, 0, "string", f"other-{lab.room}")
    other = pylsl.StreamOutlet(info)
    lab.samples([lab.clock.now_ns()], np.zeros((1, 3)))
    until(lambda: other.have_consumers(), "the service to listen")
    before = lab.clock.now_ns()
    other.push_sample(["go"])
    after = lab.clock.now_ns()
    marker = until(lambda: lab.listen() and [e for e in lab.events if e.kind == "marker"], "the event")[0]
    assert (marker.text, marker.data) == ("go", {"stream": "stimuli"})
    off_ns = lab.uncertainty_ns(1)
    lsls_ns = 50_000_000  # how well LSL compares the clocks of two programs
    assert before - off_ns - lsls_ns <= marker.time_ns <= after + off_ns + lsls_ns

    def note(text: str) -> None:
        event = Event(time_ns=lab.clock.now_ns(), kind="note", text=text)
        lab.bus.put(keys.event(lab.room, "p01"), encode(event))

    note("the stream is there from the first event on")
    inlet = lab.inlet("p01 events")
    before_s = pylsl.local_clock()
    note("second")
    after_s = pylsl.local_clock()
    rows, times = pulled(inlet, 1)
    assert rows[-1].tolist() == ["note: second"]
    assert before_s - off_ns * 1e-9 <= times[-1] <= after_s + off_ns * 1e-9
    lab.listen()
    assert [e.text for e in lab.events if e.kind == "marker"] == ["go"]


def test_three_taps_become_an_event_and_a_marker_at_the_first_one(lab: Lab):
    begin = lab.clock.now_ns() - 3_000_000_000
    acc = np.tile([0.0, 9.81, 0.0], (300, 1))
    for at in (100, 130, 165):
        acc[at, 2] += 25.0
    for first in range(0, 300, 10):
        lab.samples([begin + 10_000_000 * i for i in range(first, first + 10)], acc[first : first + 10])
    tap = until(lambda: lab.listen() and [e for e in lab.events if e.kind == "triple_tap"], "the event")[0]
    assert tap.time_ns == begin + 1_000_000_000
    assert tap.data["segment"] == "hand_r"
    assert [t - begin for t in tap.data["times_ns"]] == [1_000_000_000, 1_300_000_000, 1_650_000_000]
    until(lambda: lab.listen() and lab.health.counts.get("events"), "the marker")


def test_a_host_that_begins_anew_with_another_time_goes_on_in_lsls(lab: Lab, pylsl: Any):
    lab.samples([lab.clock.now_ns()], np.zeros((1, 3)))
    inlet = lab.inlet("p01 hand_r samples")
    lab.samples([lab.clock.now_ns()], np.zeros((1, 3)))
    _, first = pulled(inlet, 1)
    lab.clock = HostClock(time.time_ns() - time.monotonic_ns() + 5 * HOUR_NS)
    lab.inform()
    before = pylsl.local_clock()
    lab.samples([lab.clock.now_ns()], np.zeros((1, 3)))
    after = pylsl.local_clock()
    _, second = pulled(inlet, 1)
    off_s = lab.uncertainty_ns(3) * 1e-9 + 1e-6
    assert before - off_s <= second[-1] <= after + off_s
    assert second[-1] > first[-1]


def test_another_sensor_is_another_description_and_a_reader_finds_it_by_itself(lab: Lab):
    lab.samples([lab.clock.now_ns()], np.zeros((1, 3)))
    inlet = lab.inlet("p01 hand_r samples")
    lab.inform(chip="ICM-42688")

    def comes() -> bool:
        lab.samples([lab.clock.now_ns()], np.full((1, 3), 7.0))
        rows, _ = inlet.pull_chunk(timeout=0.1)
        return any(row[0] == 7.0 for row in rows)

    until(comes, "samples of the new stream")
    model = lab.inlet("p01 hand_r samples").info(timeout=WITHIN_S).desc().child("acquisition")
    assert model.child_value("model") == "ICM-42688"
