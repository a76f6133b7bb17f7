"""The emulated device on a real pseudo-terminal, through the service, a real router and back."""

import asyncio
import threading
from contextlib import contextmanager

import numpy as np
import pytest

from brachium_nodes.node_stream import Timeline
from brachium_nodes.shimmer import service
from brachium_nodes.shimmer.emulated_port import EmulatedPort, ShimmerTwin, twin_of
from brachium_nodes.shimmer.port import PortGone, SerialPort
from brachium_nodes.wearer import WearerSettings
from brachium_wire import keys
from brachium_wire.messages import Health, Info, SampleBatch, Status
from brachium_wire.samples import read_samples

pytestmark = pytest.mark.network

WEARER = WearerSettings(segments=("forearm_r",), seed=4)
REF, SEGMENT = "p01.ref", "forearm_r"


@pytest.fixture
def listening(bus, listener):
    """A function of a room that gives what is said there from now on."""
    return lambda room: type(listener)(bus, room)


@contextmanager
def device(path, timeline, delay_s=0.02):
    """A device at `path` until the end of the block; then its port is gone, as out of reach."""
    stop = threading.Event()
    if not timeline.begun:
        timeline.start()
    port = EmulatedPort(ShimmerTwin(path=path, delay_s=delay_s, jitter_s=0.002), WEARER)
    thread = threading.Thread(target=lambda: asyncio.run(port.serve(timeline, stop)))
    thread.start()
    try:
        yield port
    finally:
        stop.set()
        thread.join()


@contextmanager
def serving(endpoint, path, room):
    stop = threading.Event()
    settings = service.ShimmerSettings(
        port=str(path), subject=REF, segment=SEGMENT, endpoint=endpoint, room=room
    )
    failed = []

    def run():
        try:
            service.run(settings, stop)
        except Exception as error:
            failed.append(error)

    thread = threading.Thread(target=run)
    thread.start()
    try:
        yield failed
    finally:
        stop.set()
        thread.join()


def messages(heard, topic, kind):
    return [m for m in heard.of(topic) if isinstance(m, kind)]


def received(heard):
    return sum(len(read_samples(b)) for b in messages(heard, "imu", SampleBatch))


def test_a_shimmer_is_a_node_and_stays_one_when_it_goes_and_comes_back(
    endpoint, listening, waiting, tmp_path
):
    path, timeline, heard = tmp_path / "tty", Timeline(), listening("shim1")
    with serving(endpoint, path, "shim1"):
        with device(path, timeline):
            waiting(lambda: received(heard) > 60, "samples")
        waiting(lambda: any(not s.connected for s in messages(heard, "status", Status)), "its end")
        before = received(heard)
        with device(path, timeline):
            waiting(lambda: received(heard) > before + 60, "samples after the outage")
            waiting(lambda: messages(heard, "status", Status)[-1].connected, "a status")
        waiting(lambda: not messages(heard, "status", Status)[-1].connected, "its end")
    (info, again) = messages(heard, "info", Info)
    assert info == again
    assert (info.chip, info.rate_hz, info.origin, info.magnetometer) == ("shimmer3", 51.2, "emulated", True)
    assert info.host == info.node == "shimmer-p01.ref-forearm_r"
    assert info.calibration.mag_matrix is not None
    batches = messages(heard, "imu", SampleBatch)
    numbers = np.concatenate([b.sequence + np.arange(len(read_samples(b))) for b in batches])
    assert (np.diff(numbers) >= 1).all()
    times = np.concatenate([read_samples(b).time_ns for b in batches])
    assert (np.diff(times) > 0).all()
    last = messages(heard, "status", Status)[-1]
    gaps = int((np.diff(numbers) - 1).sum())
    assert gaps > 20  # the outage: one clock, so the numbers say how much is missing
    assert (last.received, last.lost) == (len(numbers), gaps)
    assert last.battery_v == pytest.approx(3.93, abs=0.01)
    # What it measured is what the wearer's sensor did, sample by sample.
    acc = np.concatenate([read_samples(b).acc for b in batches]) - info.calibration.accel_bias
    assert np.linalg.norm(acc[:40], axis=1) == pytest.approx(np.full(40, 9.81), abs=0.25)


def test_sample_times_are_late_by_the_way_and_say_how_sure_they_are(
    endpoint, bus, listening, waiting, tmp_path
):
    path, timeline, heard = tmp_path / "tty", Timeline(), listening("shim2")
    with serving(endpoint, path, "shim2"), device(path, timeline, delay_s=0.03):
        waiting(lambda: received(heard) > 50, "samples")
        reply = bus.ask(keys.host_time("shim2", "shimmer-p01.ref-forearm_r"))
        assert reply is not None
    wearer, name, _ = twin_of(WEARER)
    clock = wearer.clocks[name]
    for batch in messages(heard, "imu", SampleBatch):
        assert batch.uncertainty_ns >= 50_000_000
        # Host time at source time 0 is of this very process: its clocks are one.
        host_s = 1e-9 * (batch.time_ns - service.HostClock().at(timeline.start_ns))
        shown_s = clock.start_s + host_s * (1.0 + clock.skew)
        late_s = (shown_s - batch.device_us * 1e-6 + 256.0) % 512.0 - 256.0  # its clock wraps
        assert late_s > 0.029  # never before it can have come


def test_a_subject_that_comes_in_elsewhere_is_left_alone(endpoint, bus, waiting, tmp_path):
    host = f"{REF}--another"
    end = bus.announce(keys.alive("shim3", "host", host))
    with serving(endpoint, tmp_path / "tty", "shim3") as failed:
        waiting(lambda: failed, "a refusal")
    end()
    assert isinstance(failed[0], service.Busy)
    assert "comes in through host another" in str(failed[0])


def test_a_port_that_is_not_there_is_told_and_waited_for(endpoint, listening, waiting, tmp_path, caplog):
    heard = listening("shim4")
    with serving(endpoint, tmp_path / "nothing", "shim4"):
        waiting(
            lambda: any("No such file" in h.text for h in messages(heard, "health", Health)), "its complaint"
        )
        assert "No such file or directory; it is tried again until it is there" in caplog.text


def test_a_file_is_no_port(tmp_path):
    (tmp_path / "file").write_text("x")
    with pytest.raises(PortGone, match="give a serial port"):
        SerialPort(str(tmp_path / "file"))


def test_both_sensors_of_a_wearer_move_as_one():
    wearer, name, seat = twin_of(WEARER)
    assert seat == SEGMENT
    assert wearer.straps[name].seat == SEGMENT
    assert wearer.person.settings.exercise == WEARER.exercise


def test_a_service_that_is_stopped_while_it_looks_for_its_port_ends(endpoint, tmp_path):
    with serving(endpoint, tmp_path / "tty", "shim5") as failed:
        pass
    assert failed == []
