"""What comes in that is not right is counted by name and disturbs nobody."""

from collections import Counter

import msgspec
import numpy as np

from brachium_wire import keys
from brachium_wire.codec import decode, decode_topic, encode
from brachium_wire.messages import SampleBatch
from brachium_wire.samples import write_samples

MS = 1_000_000
TICK = 20 * MS
Messages = list[tuple[keys.Key, bytes]]


def test_batches_that_come_before_their_info_wait_and_none_is_lost(flow, made) -> None:
    quats, _, _ = flow.worn(made, seconds=4.0)
    messages, head = made.orientation_messages(quats), made.info_messages(quats)
    first = messages[:90]  # 30 of each segment
    wanted = flow.run(head + messages)
    got = flow.run(first + head + messages[90:])
    assert flow.difference(got[150:], wanted[150:]) < 1e-12
    assert [s.time_ns for s in got] == [s.time_ns for s in wanted]


def test_of_batches_without_any_info_the_oldest_are_dropped_and_counted_in_samples(flow, made) -> None:
    quats, _, _ = flow.worn(made, seconds=4.0)
    pipeline = flow.fed([m for m in made.orientation_messages(quats) if m[0].detail == "hand_r"])
    assert pipeline.subjects["p01"].drops == {"no_info": (80 - 64) * 5}
    assert pipeline.skeletons() == []


def test_the_same_info_again_and_again_changes_nothing(flow, made) -> None:
    quats, _, _ = flow.worn(made, seconds=5.0)
    messages, head = made.orientation_messages(quats), made.info_messages(quats)
    again: Messages = []
    for i, message in enumerate(messages):
        again += [head[i % 3], message]
    assert flow.difference(flow.run(head + again), flow.run(head + messages)) < 1e-12


def test_bytes_and_segments_that_are_not_ours_are_counted_and_nothing_good_is_lost(flow, made) -> None:
    messages = flow.noisy(made)
    pipeline = flow.fed(messages)
    wanted = flow.published(pipeline)
    key = messages[-1][0]
    spoilt = []
    for i, message in enumerate(messages):
        spoilt.append(message)
        if i > 5 and i % 7 == 0:
            spoilt.append((key, message[1][: i % 40]))
        if i > 5 and i % 11 == 0:
            spoilt.append((key._replace(detail="tail"), message[1]))
            spoilt.append((keys.Key("room", "p01", "info", "tail"), messages[0][1]))
    other = flow.fed(spoilt)
    assert flow.difference(flow.published(other), wanted) < 1e-12
    drops = other.subjects["p01"].drops
    assert drops["malformed"] > 20
    assert drops["unknown_segment"] > 20
    assert not other.drops


def test_bytes_for_a_subject_that_nobody_has_heard_of_are_counted_for_the_whole(
    flow,
) -> None:
    pipeline = flow.fed([(keys.Key("room", "ghost", "imu", "hand_r"), b"\xc1")])
    assert pipeline.drops == Counter({"malformed": 1})
    assert pipeline.subjects == {}


def test_a_sample_from_the_far_future_is_refused_and_disturbs_nobody(flow, made) -> None:
    quats, _, _ = flow.worn(made, seconds=5.0)
    messages = made.info_messages(quats) + made.orientation_messages(quats)
    key = messages[-1][0]
    bad = write_samples(
        sequence=5_000,
        time_ns=[made.START + 10**15],
        device_us=[0],
        received_ns=made.START + 4_000 * MS,
        uncertainty_ns=0,
        quat=[[1.0, 0.0, 0.0, 0.0]],
    )
    wanted = flow.run(messages)
    pipeline = flow.fed([*messages[:200], (key, encode(bad)), *messages[200:]])
    assert flow.difference(flow.published(pipeline), wanted) < 1e-12
    assert pipeline.subjects["p01"].drops == {"out_of_range": 1}


def host_messages(flow, made, host: str, from_s: float, to_s: float, quats):
    head = made.info_messages(quats, host=host)
    body = [
        m for m in made.orientation_messages(quats) if from_s <= (flow.time_of(m) - made.START) * 1e-9 < to_s
    ]
    return head, body


def test_a_second_host_is_refused_and_counted_while_the_first_is_there(flow, made) -> None:
    quats, _, _ = flow.worn(made, seconds=5.0)
    head, body = host_messages(flow, made, "gw", 0.0, 9.0, quats)
    intruder = made.info_messages(quats, host="other")
    pipeline = flow.fed([*head, *body[:60], *intruder, *body[60:]])
    assert flow.difference(flow.published(pipeline), flow.run(head + body)) < 1e-12
    assert pipeline.subjects["p01"].drops == {"second_host": 3}


def test_a_second_host_takes_over_once_the_first_was_silent_for_two_seconds(flow, made) -> None:
    quats, _, _ = flow.worn(made, seconds=8.0)
    head, body = host_messages(flow, made, "gw", 0.0, 3.5, quats)
    other, rest = host_messages(flow, made, "other", 6.0, 8.0, quats)
    pipeline = flow.fed([*head, *body, *other, *rest])
    skeletons = flow.published(pipeline)
    assert skeletons[-1].time_ns >= made.START + 7_900 * MS
    assert {t.info.host for t in pipeline.subjects["p01"].tracks.values()} == {"other"}
    assert np.all(np.diff([s.time_ns for s in skeletons]) > 0)


def test_a_sensor_replaced_in_mid_stream_begins_anew_and_the_others_go_on(flow, made) -> None:
    quats, _, _ = flow.worn(made, seconds=8.0)
    head, messages = made.info_messages(quats), made.orientation_messages(quats)
    before = [m for m in messages if flow.time_of(m) < made.START + 4_000 * MS]
    after = [m for m in messages if flow.time_of(m) >= made.START + 4_000 * MS]
    new = made.info_messages(["hand_r"])
    spare = encode(msgspec.structs.replace(decode_topic(new[0][1], "info"), node="spare"))
    fresh = [
        (k, renumbered(p)) if k.detail == "hand_r" else (k, p) for k, p in after
    ]  # another node counts from 0 again
    pipeline = flow.fed([*head, *before, (new[0][0], spare), *fresh], changes=flow.FACING)
    assert not pipeline.subjects["p01"].drops
    skeletons = flow.published(pipeline)
    assert np.all(np.diff([s.time_ns for s in skeletons]) == TICK)
    later = [s for s in skeletons if s.time_ns > made.START + 4_050 * MS]
    assert {s.segments["forearm_r"].quality for s in later} == {"good"}
    # How the spare sits on the hand nobody knows before the next pose.
    assert {s.segments["hand_r"].quality for s in later} == {"uncalibrated"}


def renumbered(payload: bytes) -> bytes:
    batch = decode(payload, SampleBatch)
    return encode(msgspec.structs.replace(batch, sequence=batch.sequence - 400))
