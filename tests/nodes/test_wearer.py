"""The emulated wearer as a whole: the same samples however they are asked for, and a consistent truth."""

from itertools import islice

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from vqf import offlineVQF

from brachium_body.angles import COLUMNS, INDEX, joint_angles
from brachium_body.continuation import AngleTracker
from brachium_body.kinematics import JOINTS, joint_orientations, positions
from brachium_body.rotation import angle_between, inverse, mean, multiply
from brachium_nodes.exercises import EXERCISES
from brachium_nodes.link import FaultSettings
from brachium_nodes.sensors import calibrated
from brachium_nodes.wearer import Packet, Readings, Wearer, WearerSettings
from brachium_wire.codec import decode, encode
from brachium_wire.messages import Skeleton
from brachium_wire.samples import read_samples, write_samples

THETA = slice(0, 7)
BLOCKS = ("time_s", "acc", "gyr", "mag")


def same(a: Readings, b: Readings) -> bool:
    return all(np.array_equal(getattr(a, name), getattr(b, name)) for name in BLOCKS)


@given(first=st.integers(0, 900), cuts=st.lists(st.integers(1, 130), min_size=1, max_size=6))
@settings(max_examples=25, deadline=None)
def test_any_cut_into_pieces_gives_the_same_samples_bit_for_bit(first: int, cuts: list[int]) -> None:
    made = WearerSettings(level="typical", exercise="reaching", seed=4, rate_hz=50.0)
    whole = Wearer(made).samples("forearm_r", first, sum(cuts))
    wearer = Wearer(made)
    starts = [first + sum(cuts[:i]) for i in range(len(cuts))]
    backwards = [wearer.samples("forearm_r", at, n) for at, n in zip(starts[::-1], cuts[::-1], strict=True)]
    for name in BLOCKS:
        joined = np.concatenate([getattr(piece, name) for piece in backwards[::-1]])
        assert np.array_equal(joined, getattr(whole, name))


def test_the_same_seed_gives_the_same_bytes_and_another_seed_others() -> None:
    def run(seed: int, segment: str = "hand_r") -> Readings:
        return Wearer(WearerSettings(seed=seed)).samples(segment, 0, 700)  # type: ignore[arg-type]

    assert same(run(1), run(1))
    for other in (run(2), run(1, "forearm_r")):  # steps of the chip are wide enough to meet now and then
        assert (run(1).acc == other.acc).mean() < 0.02
        assert (run(1).gyr == other.gyr).mean() < 0.1


def test_samples_far_into_the_exercise_need_no_past() -> None:
    settings_ = WearerSettings(seed=1, segments=("hand_r",))
    far = Wearer(settings_).samples("hand_r", 36_000_00, 10)  # ten hours
    assert np.isfinite(far.acc).all()
    assert far.time_s[0] == pytest.approx(36_000.0, rel=1e-3)


@pytest.mark.parametrize("every", [1, 3, 7])
def test_a_slower_magnetometer_keeps_its_own_beat_across_batches(every: int) -> None:
    full = Wearer(WearerSettings(seed=2)).samples("hand_r", 0, 100)
    slow = Wearer(WearerSettings(seed=2, mag_every=every))
    seen = []
    for first in range(0, 100, 10):
        part = slow.samples("hand_r", first, 10)
        assert np.array_equal(part.mag, full.mag[first + part.mag_index])
        seen += (first + part.mag_index).tolist()
    assert seen == list(range(0, 100, every))


@pytest.mark.parametrize("exercise", EXERCISES)
@pytest.mark.parametrize("side", ["right", "left"])
def test_the_truth_is_what_forward_kinematics_makes_of_its_angles(exercise: str, side: str) -> None:
    wearer = Wearer(WearerSettings(exercise=exercise, arms="both", carrying_deg=8.0, height_m=1.7, seed=5))
    t = np.arange(0.0, 30.0, 0.11)
    truth = wearer.truth(t, side)  # type: ignore[arg-type]
    segments = joint_orientations(truth.angles[:, THETA], side, carrying=np.radians(-8.0))  # type: ignore[arg-type]
    for mine, theirs in zip(list(truth.world_from_segment.values())[1:], segments, strict=True):
        # facing north, trunk axes are the world's
        assert angle_between(mine, theirs).max() < 1e-7
    chain = positions(*segments, wearer.person.lengths, side, truth.shoulder_shift)  # type: ignore[arg-type]
    for joint, name in enumerate(JOINTS):
        assert np.abs(truth.positions[name] - chain[:, joint]).max() < 1e-9
    assert np.abs(truth.angles[:, INDEX["isb_carrying"]] + np.radians(8.0)).max() < 1e-9


@pytest.mark.parametrize("exercise", EXERCISES)
def test_clinical_angles_read_from_the_truth_are_those_that_were_set(exercise: str) -> None:
    wearer = Wearer(WearerSettings(exercise=exercise, sway_deg=4.0, arms="left", seed=6))
    t = np.arange(0.0, 40.0, 0.07)
    truth, posture, trunk = wearer.truth(t, "left"), wearer.person.posture(t, "left"), wearer.person.trunk(t)
    for name, angle in {**posture.angles, **trunk.angles}.items():
        assert np.abs(truth.angles[:, INDEX[name]] - angle).max() < 1e-7, name


def test_the_truth_knows_where_its_sensors_are() -> None:
    wearer = Wearer(WearerSettings(exercise="reaching", segments=("forearm_r", "sternum"), seed=9))
    truth = wearer.truth(np.arange(0.0, 10.0, 0.1), "right")
    assert set(truth.world_from_sensor) == {"forearm_r", "sternum"}
    for segment, sensor in truth.world_from_sensor.items():
        mounted = multiply(inverse(truth.world_from_segment[segment]), sensor)  # rigid: it never changes
        assert angle_between(mounted, mounted[:1]).max() < 1e-7
        nominal = wearer.info(segment).mounting  # type: ignore[arg-type]
        assert 1.0 < np.degrees(angle_between(mounted[0], nominal)) < 30.0
    (skeleton,) = wearer.skeletons(3.0, "right", 0, AngleTracker())
    assert skeleton.segments["hand_r"].world_from_sensor is None
    assert skeleton.segments["forearm_r"].world_from_sensor == pytest.approx(
        truth.world_from_sensor["forearm_r"][30]
    )


@pytest.mark.parametrize(("level", "most_deg"), [("exact", 1.0), ("ideal", 2.0), ("typical", 5.0)])
@pytest.mark.parametrize("side", ["right", "left"])
def test_a_filter_of_others_and_a_pose_find_the_elbow(level: str, most_deg: float, side: str) -> None:
    """VQF in east, north, up turns samples into orientations; standing in neutral gives the mounting."""
    wearer = Wearer(WearerSettings(level=level, arms=side, skew_ppm=0.0, seed=3))  # type: ignore[arg-type]
    neutral, found = np.full(4, 0.5), []
    for segment in wearer.segments[:2]:
        r = wearer.samples(segment, 0, 3000)
        acc, gyr, mag = map(
            np.ascontiguousarray, calibrated(wearer.info(segment).calibration, r.acc, r.gyr, r.mag)
        )
        world_from_sensor = offlineVQF(gyr, acc, mag, 0.01)["quat9D"]
        found.append(multiply(world_from_sensor, multiply(inverse(mean(world_from_sensor[:350])), neutral)))
    elbow = joint_angles(np.full(4, np.nan), multiply(inverse(found[0]), found[1]), np.full(4, np.nan), side)  # type: ignore[arg-type]
    truth = wearer.truth(r.time_s, side).angles  # type: ignore[arg-type]
    column = INDEX["elbow_flexion"]
    off = np.degrees(elbow[:, column] - truth[:, column])
    assert np.sqrt((off**2).mean()) < most_deg
    assert np.degrees(np.ptp(truth[:, column])) > 80.0


def test_skeletons_travel_and_their_angles_have_no_jumps() -> None:
    wearer, tracker = Wearer(WearerSettings(exercise="shoulder-abduction-high")), AngleTracker()
    ticks = np.arange(0.0, 20.0, 0.02)
    skeletons = [s for part in np.split(ticks, 20) for s in wearer.skeletons(part, "right", 10**18, tracker)]
    assert [s.time_ns for s in skeletons] == [10**18 + round(t * 1e9) for t in ticks.tolist()]
    assert decode(encode(skeletons[-1]), Skeleton) == skeletons[-1]
    assert set(skeletons[0].angles) == set(COLUMNS)
    for name in ("theta2", "theta4", "shoulder_abduction", "shoulder_rotation"):
        values = np.array([s.angles[name] for s in skeletons])
        assert np.abs(np.diff(values)).max() < np.radians(6.0), name
    assert np.degrees(max(s.angles["shoulder_abduction"] for s in skeletons)) > 140.0


def test_a_stream_of_skeletons_is_the_same_truth() -> None:
    wearer, tracker = Wearer(WearerSettings(exercise="circle")), AngleTracker()
    start, first, period = 10**18, 10**18 + 7_000_003, 20_000_000
    streamed = list(islice(wearer.skeleton_stream("right", start, first, period), 120))
    assert [s.time_ns for s in streamed] == [first + period * k for k in range(120)]
    for one in streamed:
        (asked,) = wearer.skeletons((one.time_ns - start) * 1e-9, "right", start, tracker)
        assert asked.angles == pytest.approx(one.angles, abs=1e-9)
        assert asked.positions["wrist"] == pytest.approx(one.positions["wrist"], abs=1e-9)


def test_the_other_arm_hangs_in_neutral() -> None:
    truth = Wearer(WearerSettings(exercise="drinking", arms="right")).truth(np.arange(0.0, 20.0, 0.1), "left")
    assert np.abs(truth.angles[:, INDEX["theta1"] : INDEX["wrist_deviation"] + 1]).max() < 1e-12
    assert np.allclose(truth.positions["hand"], [-0.2322, 0.0, -0.792], atol=1e-12)


def test_packets_of_all_sensors_come_in_order_of_time_and_hold_what_the_wire_takes() -> None:
    wearer = Wearer(WearerSettings(batch=7, mag_every=4, seed=3))
    packets: list[Packet] = list(islice(wearer.all_packets(FaultSettings(wifi="busy")), 120))
    times = [p.send_time_s for p in packets]
    assert times == sorted(times)
    assert {p.segment for p in packets} == {"upper_arm_r", "forearm_r", "hand_r"}
    for segment in wearer.segments:
        mine = [p for p in packets if p.segment == segment]
        assert [p.sequence for p in mine] == [7 * i for i in range(len(mine))]
        device = np.concatenate([p.device_us for p in mine])
        assert set(np.diff(device)) <= {9_999, 10_000, 10_001}
        assert all(p.send_time_s > p.readings.time_s[-1] for p in mine)
    for packet in packets:
        r = packet.readings
        batch = write_samples(
            sequence=packet.sequence, time_ns=10**18 + 1000 * packet.device_us, device_us=packet.device_us,
            received_ns=10**18, uncertainty_ns=0, acc=r.acc, gyr=r.gyr, mag=r.mag if len(r.mag) else None,
            mag_index=r.mag_index if len(r.mag) else None,
        )  # fmt: skip
        assert read_samples(batch).sequence == packet.sequence


@pytest.mark.parametrize(
    "wrong",
    [
        {"exercise": "juggling"},
        {"arms": "middle"},
        {"level": "perfect"},
        {"height_m": 17.0},
        {"rate_hz": 0.0},
        {"batch": 0},
        {"mag_every": 0},
        {"segments": ("head",)},
        {"carrying_deg": -18.0},
        {"contracture_deg": 120.0},
        {"routine": "dancing"},
        {"sway_deg": 90.0},
    ],
)
def test_what_cannot_be_emulated_is_refused_by_name(wrong: dict[str, object]) -> None:
    (value,) = wrong.values()
    with pytest.raises(ValueError, match=str(value[0] if isinstance(value, tuple) else value)):
        WearerSettings(**wrong)  # type: ignore[arg-type]
