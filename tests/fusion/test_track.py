"""One sensor over time: orientation at any instant, gaps, order, calibration, stillness."""

from collections import Counter

import msgpack
import msgspec
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation, Slerp

from brachium_body import rotation
from brachium_fusion.orientation import make
from brachium_fusion.track import SegmentTrack
from brachium_wire.messages import SensorCalibration

MS = 1_000_000
UP = np.array([0.0, 0.0, 9.81])


def scipy_of(q):
    return Rotation.from_quat(np.roll(np.asarray(q), -1, axis=-1))


def solved(reading):
    return rotation.slerp(reading.before, reading.after, reading.fraction)


def tracked(made, batches, **info):
    track, drops = SegmentTrack(made.info(**info), "auto", True), Counter()
    for batch in batches:
        track.feed(batch, drops)
    return track, drops


def turning(made, first: int, n: int, rate_rad_s: float = 1.0, **more):
    """A sensor that turns evenly about its vertical axis."""
    return made.samples(first, gyr=np.tile([0.0, 0.0, rate_rad_s], (n, 1)), acc=np.tile(UP, (n, 1)), **more)


def heading_at(track, time_ns: int) -> float:
    return float(rotation.heading(solved(track.timeline.at(time_ns))))


@given(
    offsets=st.lists(st.integers(0, 190 * MS), min_size=1, max_size=12),
    cuts=st.lists(st.integers(1, 7), min_size=1),
)
@settings(max_examples=40, deadline=None)
def test_the_orientation_at_an_instant_is_scipys_slerp_between_the_samples(made, offsets, cuts) -> None:
    random = np.random.default_rng(5)
    quats = rotation.normalize(np.cumsum(random.normal(size=(20, 4)) * 0.4, axis=0) + 3.0 * rotation.IDENTITY)
    batches, at = [], 0
    for n in [*cuts, *[3] * 20]:
        if at < 20:
            batches.append(made.samples(at, quat=quats[at : at + n]))
            at += n
    track, _ = tracked(made, batches)
    times = made.sample_times(0, 20)
    judge = Slerp(np.array(times) - made.START, scipy_of(quats))
    for offset in offsets:
        reading = track.timeline.at(made.START + offset)
        assert reading is not None
        assert reading.quality == "good"
        assert (scipy_of(solved(reading)).inv() * judge(offset)).magnitude() < 1e-7
        assert reading.sequence == -(-offset // (10 * MS))


def test_nothing_is_known_before_the_first_and_after_the_last_sample(made) -> None:
    track, _ = tracked(made, [turning(made, 100, 10)])
    first, last = made.sample_times(100, 10)[0], made.sample_times(100, 10)[-1]
    assert track.timeline.at(first - 1) is None
    assert track.timeline.at(first) is not None
    assert track.timeline.at(last) is not None
    assert track.timeline.at(last + 1) is None


@pytest.mark.parametrize("magnetometer", [True, False])
def test_a_gap_up_to_100_ms_is_held_and_bridged_over_a_turn(made, magnetometer) -> None:
    track, drops = tracked(
        made,
        [turning(made, 0, 100), turning(made, 109, 50)],
        orientation_only=False,
        magnetometer=magnetometer,
    )
    assert not drops
    before = heading_at(track, made.sample_times(99, 1)[0])
    after = heading_at(track, made.sample_times(109, 1)[0])
    # VQF's rates are averages over the period: ten samples later it has turned ten periods.
    assert after - before == pytest.approx(0.1, abs=1e-3)
    inside = track.timeline.at(made.START + 1045 * MS)
    assert inside.quality == "held"
    assert inside.received_ns == made.sample_times(109, 50)[-1] + MS  # its far end came then, and so could it
    assert heading_at(track, made.START + 1045 * MS) == pytest.approx(before + 0.055, abs=1e-3)
    assert track.timeline.at(made.sample_times(99, 1)[0]).quality == "good"
    assert track.timeline.at(made.sample_times(109, 1)[0]).quality == "good"
    assert track.counter.lost == 9


def test_a_gap_beyond_100_ms_is_missing_and_the_filter_is_carried_over(made) -> None:
    batches = [
        turning(made, 0, 100),
        turning(made, 130, 50),
        turning(made, 180, 200),
        turning(made, 380, 251),
    ]
    track, _ = tracked(made, [*batches, turning(made, 631, 5)], orientation_only=False)
    before = heading_at(track, made.sample_times(99, 1)[0])
    assert track.timeline.at(made.START + 1100 * MS) is None
    assert (
        track.timeline.at(made.sample_times(130, 1)[0]).quality == "disturbed"
    )  # while the filter comes back
    assert track.timeline.at(made.sample_times(632, 1)[0]).quality == "good"
    assert heading_at(track, made.sample_times(130, 1)[0]) - before == pytest.approx(0.31, abs=1e-3)
    assert track.restarts == 0


def test_a_gap_beyond_a_second_begins_the_filter_anew(made) -> None:
    track, _ = tracked(made, [turning(made, 0, 100), turning(made, 250, 50)], orientation_only=False)
    assert track.timeline.at(made.START + 2000 * MS) is None
    assert track.restarts == 1
    fresh = make("auto", 1.0 / made.RATE, False).update(
        np.tile([0.0, 0.0, 1.0], (50, 1)), np.tile(UP, (50, 1)), None, None
    )
    assert np.array_equal(track.timeline.latest().after, fresh[-1])


@pytest.mark.parametrize(("silence", "quality"), [(2, "good"), (9, "held"), (15, None)])
def test_gaps_of_a_sensor_that_delivers_orientations(made, silence, quality) -> None:
    still = np.tile(rotation.IDENTITY, (10, 1))
    track, _ = tracked(made, [made.samples(0, quat=still), made.samples(9 + silence, quat=still)])
    reading = track.timeline.at(made.sample_times(9, 1)[0] + 5 * MS)
    assert (None if reading is None else reading.quality) == quality


def test_a_silence_without_a_missing_number_is_a_gap_too(made) -> None:
    late = [t + 60 * MS for t in made.sample_times(10, 10)]
    track, _ = tracked(
        made, [turning(made, 0, 10), turning(made, 10, 10, times=late)], orientation_only=False
    )
    assert track.timeline.at(made.sample_times(9, 1)[0] + 30 * MS).quality == "held"
    assert track.counter.lost == 0


def test_a_huge_jump_of_the_number_in_little_time_costs_nothing(made) -> None:
    batches = [turning(made, 0, 100)]
    far = 1 << 60
    batches.append(turning(made, far, 50, times=made.sample_times(100, 50)))
    track, drops = tracked(made, batches, orientation_only=False)
    assert not drops
    whole, _ = tracked(made, [turning(made, 0, 150)], orientation_only=False)
    assert np.array_equal(track.timeline.latest().after, whole.timeline.latest().after)
    assert track.timeline.at(made.START + 995 * MS).quality == "good"


def latest_of(track):
    reading = track.timeline.latest()
    return reading.after.tolist(), reading.sequence, track.last_ns


def test_what_cannot_be_used_is_counted_by_name_in_samples_and_changes_nothing_else(made) -> None:
    good = [turning(made, at, 5) for at in range(0, 40, 5)]
    wanted, _ = tracked(made, [*good[:3], *good[4:]], orientation_only=False)
    early = made.sample_times(0, 7)
    bad = {
        "repeated": good[1],
        "out_of_order": good[3],
        "late": turning(made, 900, 3, late=True),
        "time_backwards": turning(made, 25, 7, times=early),
    }
    track, drops = tracked(
        made,
        [
            *good[:2],
            bad["repeated"],
            good[2],
            good[4],
            bad["late"],
            bad["time_backwards"],
            bad["out_of_order"],
            *good[5:],
        ],
        orientation_only=False,
    )
    assert drops == {"repeated": 5, "out_of_order": 5, "late": 3, "time_backwards": 7}
    assert latest_of(track) == latest_of(wanted)


def test_a_refused_batch_with_a_far_number_loses_nothing_after_it(made) -> None:
    evil = turning(made, 1 << 50, 5, times=made.sample_times(0, 5))
    track, drops = tracked(made, [turning(made, 0, 10), evil, turning(made, 10, 10)], orientation_only=False)
    assert drops == {"time_backwards": 5}
    assert track.last_ns == made.sample_times(19, 1)[0]


def test_calibration_is_applied_as_the_wire_page_says(made) -> None:
    """gyr - gyro_bias; accel_scale * (acc - accel_bias); mag_matrix (mag - mag_offset)."""
    random = np.random.default_rng(2)
    gyr, acc = random.normal(0.0, 0.3, (300, 3)), UP + random.normal(0.0, 1.0, (300, 3))
    mag = np.array([3.0, 23.0, -40.0]) + random.normal(0.0, 1.0, (300, 3))
    bias, scale, offset = (
        np.array([0.1, -0.2, 0.05]),
        np.array([1.1, 0.9, 1.05]),
        np.array([12.0, -7.0, 30.0]),
    )
    accel_bias = np.array([0.4, -0.3, 0.2])
    matrix = np.eye(3) + random.normal(0.0, 0.2, (3, 3))
    raw = made.samples(
        0,
        gyr=gyr + bias,
        acc=acc / scale + accel_bias,
        mag=np.linalg.solve(matrix, mag.T).T + offset,
    )
    calibration = SensorCalibration(
        gyro_bias=tuple(bias),
        accel_scale=tuple(scale),
        accel_bias=tuple(accel_bias),
        mag_offset=tuple(offset),
        mag_matrix=tuple(tuple(row) for row in matrix),
    )
    track, _ = tracked(made, [raw], orientation_only=False, magnetometer=True, calibration=calibration)
    wanted = make("auto", 1.0 / made.RATE, True).update(gyr, acc, mag, None)
    assert track.timeline.latest().after == pytest.approx(wanted[-1], abs=1e-9)


def test_a_sensor_that_delivers_orientations_is_taken_at_its_word(made) -> None:
    random = np.random.default_rng(9)
    quats = rotation.normalize(random.normal(size=(30, 4)))
    track, _ = tracked(made, [made.samples(0, quat=quats)], magnetometer=True)
    for i, time_ns in enumerate(made.sample_times(0, 30)):
        assert rotation.angle_between(solved(track.timeline.at(time_ns)), quats[i]) < 1e-12


def test_still_begins_after_the_last_turn_that_was_too_fast(made) -> None:
    gyr = np.zeros((50, 3))
    gyr[20] = [0.0, 0.0, 0.2]
    gyr[30] = [0.0, 0.14, 0.0]
    track, _ = tracked(made, [made.samples(0, gyr=gyr, acc=np.tile(UP, (50, 1)))], orientation_only=False)
    assert track.still_since_ns == made.sample_times(20, 1)[0] + 1
    angle = np.concatenate([np.linspace(0.0, 0.1, 20), np.full(30, 0.1)])
    track, _ = tracked(made, [made.samples(0, quat=rotation.about(2, angle))])
    assert track.still_since_ns == made.sample_times(19, 1)[0] + 1


@given(cut=st.integers(1, 11))
@settings(max_examples=11, deadline=None)
def test_a_track_put_back_goes_on_as_if_it_had_never_stopped(made, cut) -> None:
    random = np.random.default_rng(4)
    batches = [
        made.samples(
            first,
            gyr=random.normal(0.0, 1.0, (10, 3)),
            acc=UP + random.normal(0.0, 1.0, (10, 3)),
            mag=np.array([3.0, 23.0, -40.0]) + random.normal(0.0, 1.0, (10, 3)),
        )
        for first in (0, 10, 30, 20, 40, 43, 50, 65, 300, 310, 305, 320)
    ]
    info = {"orientation_only": False, "magnetometer": True}
    whole, drops = tracked(made, batches, **info)
    first, before = tracked(made, batches[:cut], **info)
    second = SegmentTrack(made.info(**info), "auto", True)
    second.restore(msgpack.unpackb(msgpack.packb(first.state())))
    for batch in batches[cut:]:
        second.feed(batch, before)
    assert before == drops
    assert msgpack.packb(second.state()) == msgpack.packb(whole.state())  # a young filter's state holds NaN
    for time_ns in range(whole.timeline.first_ns, whole.last_ns, 7 * MS):
        a, b = whole.timeline.at(time_ns), second.timeline.at(time_ns)
        if second.timeline.first_ns <= time_ns:
            assert (a is None) == (b is None)
            assert a is None or np.array_equal(solved(a), solved(b))


def test_what_is_forgotten_is_never_the_last_batch_nor_what_an_instant_needs(made) -> None:
    track, _ = tracked(made, [turning(made, at, 5) for at in range(0, 50, 5)], orientation_only=False)
    instant = made.START + 222 * MS
    wanted = track.timeline.at(instant)
    track.timeline.forget(instant)
    assert track.timeline.first_ns == made.sample_times(20, 1)[0]
    assert np.array_equal(solved(track.timeline.at(instant)), solved(wanted))
    track.timeline.forget(track.last_ns + 10**9)
    assert track.timeline.first_ns == made.sample_times(45, 1)[0]
    assert track.timeline.latest() is not None


def test_a_disturbed_field_is_told_once_it_lasted_two_seconds(made) -> None:
    random = np.random.default_rng(6)
    angles = np.cumsum(np.cumsum(random.normal(0.0, 0.004, (4000, 3)), axis=0) * 0.05, axis=0) * 3.0
    truth = Rotation.from_euler("ZXY", np.sin(angles) * [2.0, 0.8, 0.8])
    step = (truth[:-1].inv() * truth[1:]).as_rotvec() * made.RATE
    gyr, inverse = np.vstack([step[:1], step]), truth.inv()
    acc, mag = inverse.apply(UP), inverse.apply(np.array([0.0, 23.0, -40.0]))
    mag[2500:] += [60.0, 0.0, 0.0]
    track, drops = SegmentTrack(made.info(orientation_only=False, magnetometer=True), "auto", True), Counter()
    seen = []
    for at in range(0, 4000, 10):
        part = slice(at, at + 10)
        track.feed(made.samples(at, gyr=gyr[part], acc=acc[part], mag=mag[part]), drops)
        seen.append(track.timeline.at(track.last_ns).quality)
    first = seen.index("disturbed") * 10
    assert 2700 <= first <= 2900


def test_a_node_that_was_switched_off_and_on_is_taken_on(made) -> None:
    again = msgspec.structs.replace(turning(made, 300, 50), sequence=0)
    track, drops = tracked(made, [turning(made, 0, 100), again], orientation_only=False)
    assert not drops
    assert track.reboots == 1
    assert track.counter.received == 150
    assert track.counter.lost == 0
    assert track.timeline.at(again.time_ns[10]) is not None


def test_an_old_batch_that_comes_again_is_no_new_start(made) -> None:
    track, drops = tracked(
        made, [turning(made, 0, 50), turning(made, 50, 50), turning(made, 0, 50)], orientation_only=False
    )
    assert drops == {"repeated": 50}
    assert track.reboots == 0


def test_motion_lies_on_the_line_between_calibrated_samples_and_nowhere_in_a_long_gap(made) -> None:
    gyr = np.column_stack([np.arange(30.0) * 0.1, np.zeros(30), np.ones(30)])
    acc = np.tile([0.0, 0.0, 9.81], (30, 1)) + np.arange(30.0)[:, None] * 0.01
    calibration = SensorCalibration(gyro_bias=(0.0, 0.5, 0.0), accel_scale=(1.0, 1.0, 2.0))
    batches = [made.samples(n, gyr=gyr[n : n + 10], acc=acc[n : n + 10]) for n in (0, 10)]
    batches.append(made.samples(40, gyr=gyr[20:], acc=acc[20:]))
    track, _ = tracked(made, batches, orientation_only=False, calibration=calibration)

    def at(sample: float):
        return track.timeline.motion_at(made.START + round(sample * 10 * MS))

    for sample in (0.0, 3.0, 3.25, 9.5, 10.0, 19.0):
        assert at(sample).gyr == pytest.approx([0.1 * sample, -0.5, 1.0])
        assert at(sample).acc == pytest.approx([0.01 * sample, 0.01 * sample, 2.0 * (9.81 + 0.01 * sample)])
    assert at(45.0).gyr[0] == pytest.approx(2.5)
    assert [at(s) for s in (-0.1, 19.5, 39.0, 49.1)] == [None] * 4


def trembling(made, numbers):
    """A sensor whose rate about the vertical is a tremor of 5 Hz, 50 samples a second: rad/s."""
    gyr = np.zeros((len(numbers), 3))
    gyr[:, 2] = np.sin(2.0 * np.pi * 5.0 * np.asarray(numbers) / 50.0)
    return made.samples(
        numbers[0],
        gyr=gyr,
        acc=np.tile(UP, (len(numbers), 1)),
        times=[made.START + 20 * MS * i for i in numbers],
    )


def test_a_lost_sample_of_a_tremor_costs_an_eighth_of_what_a_straight_line_would(made) -> None:
    numbers = np.arange(100)
    errors = []
    for lost in range(40, 50):
        pieces = [list(numbers[:lost]), list(numbers[lost + 1 :])]
        whole, _ = tracked(made, [trembling(made, list(numbers))], orientation_only=False, rate_hz=50.0)
        holed, _ = tracked(made, [trembling(made, p) for p in pieces], orientation_only=False, rate_hz=50.0)
        end = made.START + 99 * 20 * MS
        errors.append(heading_at(holed, end) - heading_at(whole, end))
    straight = 0.19 * 0.02 / np.sqrt(2.0)
    assert np.sqrt(np.mean(np.square(errors))) < straight / 7.0


def test_who_follows_a_sensor_goes_through_a_gap_that_is_waited_for_and_not_shown(made) -> None:
    batches = [turning(made, 0, 100), turning(made, 113, 50)]
    track, _ = tracked(made, batches, orientation_only=False)
    inside = made.START + 1055 * MS
    assert track.timeline.at(inside) is None
    assert track.timeline.motion_at(inside) is None
    through = track.timeline.at(inside, unseen=True)
    before = heading_at(track, made.sample_times(99, 1)[0])
    assert float(rotation.heading(solved(through))) == pytest.approx(before + 0.065, abs=1e-3)
    assert track.timeline.motion_at(inside, unseen=True).gyr == pytest.approx([0.0, 0.0, 1.0])
    long, _ = tracked(made, [turning(made, 0, 100), turning(made, 120, 50)], orientation_only=False)
    assert long.timeline.at(inside, unseen=True) is None


def test_what_was_bridged_is_part_of_the_state(made) -> None:
    batches = [turning(made, 0, 1), turning(made, 1, 1), turning(made, 4, 1), turning(made, 7, 3)]
    first, drops = tracked(made, batches[:3], orientation_only=False)
    second = SegmentTrack(made.info(orientation_only=False), "auto", True)
    second.restore(msgpack.unpackb(msgpack.packb(first.state())))
    for track in (first, second):
        track.feed(batches[3], drops)
    for offset in (15, 25, 45, 55, 65, 85):
        at = made.START + offset * MS
        one, other = first.timeline.at(at), second.timeline.at(at)
        assert np.array_equal(solved(one), solved(other))
        assert np.array_equal(first.timeline.motion_at(at).acc, second.timeline.motion_at(at).acc)
