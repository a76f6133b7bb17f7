"""Names of keys: what goes in comes out, and nothing evil goes in."""

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from brachium_wire import keys
from brachium_wire.topics import TOPICS

EVIL = [
    "",
    "*",
    "**",
    "$*",
    "a*",
    "a b",
    " a",
    "a\t",
    "a\n",
    "a\x00",
    "a/b",
    "/",
    "ä",
    "имя",
    "a\u200b",
    "..",
    ".",
    ".hidden",
    "@adminspace",
    "a#b",
    "a?b",
    "'",
    '"',
    "x" * 65,
    "x" * 70_000,
]
CHUNKS = st.from_regex(keys._CHUNK, fullmatch=True)
SUBJECTS = CHUNKS.filter(lambda name: name != keys.SERVICE)
BUILDERS = {
    "imu": keys.imu,
    "info": keys.info,
    "status": keys.status,
    "skeleton": keys.skeleton,
    "truth": keys.truth,
    "command": keys.command,
}
PLAIN_BUILDERS = {
    "calibration": keys.calibration,
    "session": keys.session,
    "event": keys.event,
    "snapshot": keys.snapshot,
}


@pytest.mark.parametrize("name", EVIL)
def test_evil_chunks_are_refused_wherever_they_stand(name: str) -> None:
    calls: list[Any] = [
        lambda: keys.chunk(name),
        lambda: keys.subject_chunk(name),
        lambda: keys.everything(name),
        lambda: keys.service("gym", name, "id"),
        lambda: keys.service("gym", "kind", name),
        lambda: keys.alive("gym", "kind", name),
        lambda: keys.host_time("gym", name),
        lambda: keys.commands("gym", name),
        lambda: keys.calibration(name, "p01"),
        lambda: keys.calibration("gym", name),
        lambda: keys.parse(f"brachium/gym/{name}/event"),
        lambda: keys.parse(f"brachium/{name}/p01/event"),
        lambda: keys.parse(f"brachium/gym/p01/imu/{name}"),
    ]
    calls += [lambda build=build: build("gym", "p01", name) for build in BUILDERS.values()]
    for call in calls:
        with pytest.raises(keys.BadKey) as error:
            call()
        assert "\n" not in str(error.value)
        assert len(str(error.value)) < 250


@pytest.mark.parametrize("name", ["*", "**"])
def test_one_wildcard_only_where_an_expression_is_built(name: str) -> None:
    assert keys.subjects("gym", "imu/*", "*") == "brachium/gym/*/imu/*"
    assert keys.expression(f"brachium/gym/{name}/event") == f"brachium/gym/{name}/event"
    with pytest.raises(keys.BadKey):
        keys.event("gym", name)


@pytest.mark.parametrize(
    "text", ["", "a//b", "/a", "a/", "a/b*", "a/$*", "a/@b", "a b", "a?b", "x/" * 600 + "x"]
)
def test_evil_expressions_are_refused(text: str) -> None:
    with pytest.raises(keys.BadKey):
        keys.expression(text)


def test_64_characters_are_taken_and_dots_inside() -> None:
    assert keys.chunk("x" * 64) == "x" * 64
    assert keys.parse(keys.event("gym", "p01.ref")).subject == "p01.ref"
    assert keys.chunk("a..b") == "a..b"


def test_service_is_nobodys_name() -> None:
    with pytest.raises(keys.BadKey, match="services' own"):
        keys.event("gym", "service")
    with pytest.raises(keys.BadKey):
        keys.subjects("gym", "event", "service")
    assert keys.parse(keys.event("service", "p01")).room == "service"


@pytest.mark.parametrize("name", [None, 3, b"p01", ["a"]])
def test_what_is_no_text_is_refused(name: Any) -> None:
    with pytest.raises(keys.BadKey):
        keys.chunk(name)


@given(CHUNKS, SUBJECTS, CHUNKS)
def test_built_keys_are_read_back(room: str, subject: str, detail: str) -> None:
    for topic, build in BUILDERS.items():
        assert keys.parse(build(room, subject, detail)) == keys.Key(room, subject, topic, detail)
    for topic, plain in PLAIN_BUILDERS.items():
        assert keys.parse(plain(room, subject)) == keys.Key(room, subject, topic, "")


@given(CHUNKS, CHUNKS, CHUNKS)
def test_keys_of_services_are_read_back(room: str, kind: str, service_id: str) -> None:
    detail = f"{kind}/{service_id}"
    assert keys.parse(keys.service(room, kind, service_id)) == keys.Key(room, "service", "health", detail)
    assert keys.parse(keys.alive(room, kind, service_id)) == keys.Key(room, "service", "alive", detail)
    told = keys.parse(keys.host_time(room, service_id))
    assert told == keys.Key(room, "service", "time", f"gateway/{service_id}")


@given(
    st.text()
    | st.lists(st.sampled_from(["brachium", "gym", "service", "imu", "info", "*", "", "event"])).map("/".join)
)
def test_any_text_is_a_key_or_refused(text: str) -> None:
    try:
        key = keys.parse(text)
    except keys.BadKey:
        return
    assert text.startswith(f"brachium/{key.room}/{key.subject}/")
    assert key.topic in TOPICS or key.topic in ("alive", "time")
    assert "*" not in text


@pytest.mark.parametrize(
    "key",
    [
        "brachium/gym/p01",
        "brachium/gym/p01/imu",
        "brachium/gym/p01/imu/hand_r/other",
        "brachium/gym/p01/imu/hand_r/info/more",
        "brachium/gym/p01/skeleton",
        "brachium/gym/p01/calibration/more",
        "brachium/gym/p01/unknown",
        "brachium/gym/service/fusion",
        "brachium/gym/service/fusion/f1/other",
        "Brachium/gym/p01/event",
        "gym/p01/event",
    ],
)
def test_keys_of_no_topic_are_refused(key: str) -> None:
    with pytest.raises(keys.BadKey):
        keys.parse(key)
