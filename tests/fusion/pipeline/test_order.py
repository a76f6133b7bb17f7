"""How messages come, and a pipeline put back in mid-stream, play no part in what it gives."""

import msgspec
import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from brachium_fusion.pipeline import Pipeline
from brachium_fusion.settings import Settings
from brachium_wire import keys
from brachium_wire.codec import decode
from brachium_wire.messages import Skeleton, Snapshot

MS = 1_000_000
Messages = list[tuple[keys.Key, bytes]]


@given(cuts=st.lists(st.integers(1, 60), max_size=12), drained=st.booleans())
@settings(max_examples=15, deadline=None)
def test_how_messages_are_bunched_and_when_skeletons_are_taken_plays_no_part(
    flow, made, cuts, drained
) -> None:
    messages = flow.noisy(made)
    whole = Pipeline()
    whole.feed_all(messages)
    wanted = flow.published(whole)
    pipeline, got, at = Pipeline(), [], 0
    for n in [*cuts, len(messages)]:
        pipeline.feed_all(messages[at : at + n])
        at += n
        if drained:
            got += flow.published(pipeline)
    got += flow.published(pipeline)
    assert flow.difference(got, wanted) < 1e-12


def test_one_by_one_is_the_same_as_all_at_once_whatever_is_among_them(flow, made) -> None:
    messages = flow.noisy(made, seconds=4.0)
    key = messages[-1][0]
    evil = [
        (key, b""),
        (key, b"\x80"),
        (key, messages[-1][1][:-3]),
        (key._replace(detail="left_knee"), messages[-1][1]),
        (keys.Key("room", "p01", "info", "hand_r"), b"\xc0"),
        (keys.Key("room", "p01", "status", "hand_r"), b"\xc0"),
    ]
    for at, message in zip((40, 90, 91, 130, 150, 170), evil, strict=True):
        messages.insert(at, message)
    one_by_one, at_once = flow.fed(messages), Pipeline()
    at_once.feed_all(messages)
    drops = one_by_one.subjects["p01"].drops
    assert drops == at_once.subjects["p01"].drops
    assert drops == {"malformed": 3, "wrong_version": 1, "unknown_segment": 5}
    assert flow.difference(flow.published(one_by_one), flow.published(at_once)) < 1e-12


@given(shifts=st.lists(st.integers(1, 4), min_size=30, max_size=30))
@settings(max_examples=15, deadline=None)
def test_the_order_among_segments_changes_no_number_when_nothing_is_late(flow, made, shifts) -> None:
    quats, _, _ = flow.worn(made, seconds=6.0)
    messages = made.orientation_messages(quats)
    head = made.info_messages(quats) + messages[:3]
    wanted = flow.run(head + messages[3:])
    queues = {key: [m for m in messages[3:] if m[0] == key] for key, _ in messages[:3]}
    mixed: Messages = []
    names = list(queues)
    while any(queues.values()):
        for i, shift in enumerate(shifts):  # each in turn runs ahead by some batches, at most 3
            queue = queues[names[i % 3]]
            longest = max(len(q) for q in queues.values())
            for _ in range(shift):
                if queue and longest - len(queue) < 2:
                    mixed.append(queue.pop(0))
                    longest = max(len(q) for q in queues.values())
    got = flow.run(head + mixed)
    numbers = [replace_arrival(s) for s in got]
    assert flow.difference(numbers, [replace_arrival(s) for s in wanted]) < 1e-12


def replace_arrival(skeleton: Skeleton) -> Skeleton:
    return msgspec.structs.replace(skeleton, received_ns=None)


def test_many_arms_are_each_as_if_alone(flow, made) -> None:
    people = {
        f"p{i:02d}": flow.worn(made, ("right", "left")[: 1 + i % 2], i == 2, seed=i)[0] for i in range(5)
    }
    messages = {
        name: made.info_messages(quats, name) + made.orientation_messages(quats, subject=name, batch=3 + i)
        for i, (name, quats) in enumerate(people.items())
    }
    together = Pipeline()
    queues = [list(queue) for queue in messages.values()]
    random = np.random.default_rng(0)
    while queues:
        queue = queues[random.integers(len(queues))]
        together.feed_all([queue.pop(0) for _ in range(min(len(queue), int(random.integers(1, 9))))])
        queues = [q for q in queues if q]
    solved = together.skeletons()
    for name in people:
        alone = flow.fed(messages[name])
        assert (
            flow.difference([s.skeleton for s in solved if s.subject == name], flow.published(alone)) < 1e-12
        )


@given(cut=st.floats(0.0, 1.0))
@settings(max_examples=12, deadline=None)
def test_a_pipeline_put_back_in_mid_stream_goes_on_as_if_it_had_never_stopped(flow, made, cut) -> None:
    messages = flow.noisy(made)
    changes = [
        flow.session_change(facing_deg=0.0),
        flow.session_change(made.START + 4_000 * MS, height_m=1.6),
    ]
    whole = flow.published(flow.fed(messages, changes=changes))
    at = int(cut * len(messages))
    first = flow.fed(messages[:at], changes=changes)
    before = flow.published(first)
    snapshot = decode(first.snapshot("p01"), Snapshot)
    second = Pipeline(Settings(**snapshot.settings))
    second.restore("p01", snapshot)
    after = flow.published(flow.fed(messages[at:], pipeline=second))
    assert flow.difference(before + after, whole) < 1e-12
    assert (at == 0) == (not before) or at < 20


def test_a_snapshot_keeps_what_still_waits_for_its_info(flow, made) -> None:
    quats, _, _ = flow.worn(made, seconds=4.0)
    head, messages = made.info_messages(quats), made.orientation_messages(quats)
    stream = [*head[:2], *messages[:60], head[2], *messages[60:]]
    whole = flow.published(flow.fed(stream))
    first = flow.fed(stream[:40])
    before = flow.published(first)
    second = Pipeline()
    second.restore("p01", decode(first.snapshot("p01"), Snapshot))
    assert flow.difference(before + flow.published(flow.fed(stream[40:], pipeline=second)), whole) < 1e-12
