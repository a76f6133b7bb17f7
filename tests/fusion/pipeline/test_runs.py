"""How a run begins, what it says of itself, and the next run of the same sensors."""

import msgspec
import pytest

from brachium_wire import keys
from brachium_wire.codec import decode, encode
from brachium_wire.messages import SampleBatch

MS = 1_000_000
Messages = list[tuple[keys.Key, bytes]]


def test_the_origin_that_is_no_person_wins(flow, made) -> None:
    quats, _, _ = flow.worn(made, seconds=1.0)
    for origins, wanted in ((("worn",) * 3, "worn"), (("worn", "playback", "worn"), "playback")):
        head = [
            made.info_messages([segment], origin=origin)[0]
            for segment, origin in zip(quats, origins, strict=True)
        ]
        assert {s.origin for s in flow.run(head + made.orientation_messages(quats))} == {wanted}


def test_a_skeleton_names_the_last_sample_it_used_and_when_that_came(flow, made) -> None:
    quats, _, _ = flow.worn(made, seconds=2.0)
    messages = made.orientation_messages(quats)
    arrivals = {}
    for message in messages:
        batch = decode(message[1], SampleBatch)
        for i in range(5):
            arrivals[message[0].detail, batch.sequence + i] = batch.received_ns
    for skeleton in flow.run(made.info_messages(quats) + messages)[3:]:
        used = [(segment, pose.sequence) for segment, pose in skeleton.segments.items()]
        for _, sequence in used:
            assert made.sample_times(sequence, 1)[0] == skeleton.time_ns
        assert skeleton.received_ns == max(arrivals[u] for u in used)


def test_sensors_that_begin_together_are_solved_together_whichever_is_heard_first(flow, made) -> None:
    quats, _, _ = flow.worn(made, seconds=3.0)
    head, body = made.info_messages(quats), made.orientation_messages(quats)
    for first in (body[:3], body[2::-1], [body[1], body[0], body[2]]):
        skeletons = flow.run([*head, *first, *body[3:]])
        assert skeletons[0].time_ns == made.START
        assert set(skeletons[0].segments) == set(quats)


def test_a_known_sensor_that_never_begins_holds_nobody_up_for_longer_than_150_ms(flow, made) -> None:
    quats, _, _ = flow.worn(made, seconds=2.0)
    head = made.info_messages(quats)
    body = [m for m in made.orientation_messages(quats, batch=1) if m[0].detail != "hand_r"]
    pipeline = flow.fed(head)
    first = None
    for message in body:
        pipeline.feed(*message)
        if pipeline.skeletons():
            first = flow.time_of(message) - made.START
            break
    assert first is not None
    assert 150 * MS <= first <= 180 * MS


def later(messages: Messages, by_ns: int) -> Messages:
    """Return another run: numbers from 0 again, times later."""
    moved = []
    for key, payload in messages:
        batch = decode(payload, SampleBatch)
        batch = msgspec.structs.replace(
            batch, time_ns=batch.time_ns + by_ns, received_ns=batch.received_ns + by_ns
        )
        moved.append((key, encode(batch)))
    return moved


@pytest.mark.parametrize("origin", ["emulated", "worn"])
def test_a_second_run_of_the_same_sensors_goes_on_and_who_is_not_worn_stands_in_a_pose_again(
    flow, made, origin
) -> None:
    quats, _, _ = flow.worn(made, seconds=6.0)
    messages = made.orientation_messages(quats)
    pipeline = flow.fed([*made.info_messages(quats, origin=origin), *messages])
    first = flow.published(pipeline)
    second = flow.published(flow.fed(later(messages, 60_000_000_000), pipeline=pipeline))
    assert len(second) > 0.95 * len(first)
    assert not pipeline.subjects["p01"].drops
    qualities = {s.segments["forearm_r"].quality for s in second}
    assert ("uncalibrated" in qualities) == (origin == "emulated")
    assert second[-1].segments["forearm_r"].quality in ("good", "heading_assumed")


def test_another_emulated_wearer_under_the_same_names_is_calibrated_anew(flow, made) -> None:
    quats, _, _ = flow.worn(made, seconds=6.0)
    messages = made.orientation_messages(quats)
    pipeline = flow.fed([*made.info_messages(quats), *messages])
    assert flow.published(pipeline)[-1].segments["forearm_r"].quality in ("good", "heading_assumed")
    other = made.info_messages(quats, firmware="another")
    second = flow.published(flow.fed([*other, *later(messages, 60_000_000_000)], pipeline=pipeline))
    begun = {s.segments["forearm_r"].quality for s in second[:100] if "forearm_r" in s.segments}
    assert begun == {"uncalibrated"}
    assert second[-1].segments["forearm_r"].quality in ("good", "heading_assumed")
