"""Figures of CAN: what counts as mixed, as wrong, and as not told; and the real service between processes."""

import socket
from itertools import islice

import numpy as np
import pytest

from brachium import bench_can
from brachium.can_fault_figures import Frames, ShowsNothing, figures
from brachium.can_traffic import GROUP, sample
from brachium.can_wearer import Appointed, stream_of, wearer
from brachium.node_promises import NODE_PROOFS
from brachium_nodes.can.arm_frames import Reason
from brachium_nodes.can.grouping import Sample
from brachium_nodes.can.joint_table import JOINTS

HOST_NS = 1_790_000_000_000_000_000
START_NS, FAULT_NS, TICK_NS = 5_000_000_000, 17_000_000_000, 10_000_000
LABELS = ["".join(word.capitalize() for word in joint.split("_")) for joint in JOINTS]


@pytest.fixture(scope="module")
def truth() -> dict[int, dict[str, float]]:
    """Angles by the time in ns since the wearer's start."""
    made = wearer().skeleton_stream("right", 0, 0, TICK_NS)
    return {s.time_ns: s.angles for s in islice(made, 1600)}


def frames(truth: dict[int, dict[str, float]], invalid_from_ms: int, off_deg: float) -> Frames:
    """An arm that is told for 15 s, turned by `off_deg` from 12 s on, and invalid from some ms after that."""
    heard = Frames(at_ns=[], read=[])
    for k in range(100, 1500):
        late = k * TICK_NS - (FAULT_NS - START_NS)
        heard.at_ns.append(START_NS + k * TICK_NS)
        read: dict[str, float] = {"SampleTime": (HOST_NS + START_NS + k * TICK_NS) // 10**6 % (2**32 - 1)}
        for label, name in zip(LABELS, JOINTS, strict=True):
            read[label + "Valid"] = int(late < invalid_from_ms * 1_000_000)
            read[label + "Reason"] = 0 if read[label + "Valid"] else Reason.SILENT
            read[label + "Angle"] = truth[k * TICK_NS][name] + (np.radians(off_deg) if late >= 0 else 0.0)
        heard.read.append(read)
    return heard


@pytest.mark.parametrize(
    ("invalid_from_ms", "off_deg", "wrong", "valid"),
    [(60, 0.0, 0, 0), (51, 6.0, 0, 0), (100, 4.0, 0, 28), (100, 6.0, 28, 28), (9999, 0.0, 0, 2058)],
)
def test_what_is_valid_and_wrong_after_a_fault_counts(
    truth: dict[int, dict[str, float]], invalid_from_ms: int, off_deg: float, wrong: int, valid: int
):
    made = figures("jump", frames(truth, invalid_from_ms, off_deg), HOST_NS, START_NS, FAULT_NS, [])
    assert (made.wrong_after, made.valid_after) == (wrong, valid)
    assert made.frames_after == 294
    assert made.valid_before == 1.0
    assert made.worst_before_deg is not None
    assert made.worst_before_deg < 0.2  # the time is told in ms


def test_a_round_in_which_nothing_was_valid_shows_nothing(truth: dict[int, dict[str, float]]):
    with pytest.raises(ShowsNothing, match="silent"):
        figures("node killed", frames(truth, -10_000, 0.0), HOST_NS, START_NS, FAULT_NS, [])


def test_a_truth_topic_that_says_another_angle_is_named(truth: dict[int, dict[str, float]]):
    told = list(islice(wearer().skeleton_stream("right", HOST_NS, HOST_NS, TICK_NS), 1150, 1200))
    with pytest.raises(RuntimeError, match="the truth topic says another"):
        figures("jump", frames(truth, 60, 0.0), HOST_NS - START_NS + 10**10, START_NS, FAULT_NS, told)


def test_a_node_of_orientations_turns_at_its_jump_and_at_no_other_time():
    plain, turned = (
        list(islice(stream_of("p01", "forearm_r", turned=True, jump_s=s, jump_deg=30.0).packets, 40))
        for s in (None, 0.4)
    )
    times = np.concatenate([p.times_s for p in plain])
    apart = np.abs(
        np.sum(
            [
                np.frombuffer(a.batch.quat, "<f4").reshape(-1, 4)
                * np.frombuffer(b.batch.quat, "<f4").reshape(-1, 4)
                for a, b in zip(plain, turned, strict=True)
            ],
            axis=2,
        )
    ).ravel()
    np.testing.assert_allclose(apart, np.where(times >= 0.4, np.cos(np.radians(15)), 1.0), atol=1e-6)
    assert Appointed(7).start_ns == 7


def test_a_field_that_is_turned_keeps_its_strength_and_its_dip():
    plain, turned = (
        list(islice(stream_of("p01", "forearm_r", turned=False, jump_s=s, jump_deg=60.0).packets, 40))
        for s in (None, 0.4)
    )
    fields = [
        np.concatenate([np.frombuffer(p.batch.mag, "<f4").reshape(-1, 3) for p in packets])
        for packets in (plain, turned)
    ]
    times = np.concatenate([p.times_s for p in plain])
    apart = np.linalg.norm(fields[0] - fields[1], axis=1)
    assert (apart[times < 0.38] == 0.0).all()
    assert (apart[times > 0.42] > 10.0).all()  # uT
    np.testing.assert_allclose(*(np.linalg.norm(f, axis=1) for f in fields), rtol=1e-5)


def test_samples_of_two_are_found():
    whole = Sample(1.0, 0, {"acc": (1.0,), "gyr": (1.0,)})
    mixed = Sample(2.0, 0, {"acc": (2.0,), "gyr": (1.0,)})
    assert bench_can._looked_at([whole, mixed]) == (1, 0)
    assert bench_can._looked_at([mixed, whole]) == (1, 1)
    made = bench_can.mixing(2000)
    assert (made.samples, made.mixed, made.out_of_order) == (2000, 0, 0)
    assert made.given > 800


def test_every_promise_of_can_is_one_of_a_command():
    names = {proof.name for proof in NODE_PROOFS}
    assert {"can-load", "can-mixing", "can-faults"} <= names


def multicast() -> bool:
    """Whether this host hears its own multicast."""
    import can

    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    try:
        words = {"interface": "udp_multicast", "channel": GROUP, "port": port, "hop_limit": 0}
        with can.Bus(**words) as a, can.Bus(**words) as b:
            a.send(can.Message(arbitration_id=1, data=sample(0, 100)[0][1]))
            return b.recv(2.0) is not None
    except (OSError, can.CanError):
        return False


@pytest.mark.network
def test_sensors_of_another_process_come_in_and_none_is_lost():
    if not multicast():
        pytest.skip("no multicast on this host: give loopback the route 239.0.0.0/8")
    made = bench_can.load(1.0, sensors=3, rate_hz=50)  # the kernel counts a process in ticks of 10 ms
    assert made.sensors == 3
    assert made.cpu > 0.0
    assert made.frames_per_s > 0.0
