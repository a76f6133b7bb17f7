"""Each key that is heard is declared once, and no stranger makes it declare without end."""

from hypothesis import given
from hypothesis import strategies as st

from brachium_wire import keys
from brachium_wire.heard_keys import MOST_KEYS, HeardKeys

IMU = [keys.imu("gym", f"p{number:03d}", "forearm_r") for number in range(5)]


@given(st.lists(st.sampled_from(IMU), max_size=30))
def test_a_key_is_declared_at_its_first_message(messages: list[str]) -> None:
    declared: list[str] = []
    heard = HeardKeys(lambda key: declared.append(key) or key)
    for key in messages:
        heard.see(key)
    assert declared == list(dict.fromkeys(messages))


def test_what_is_no_key_of_ours_is_not_declared() -> None:
    declared: list[str] = []
    heard = HeardKeys(lambda key: declared.append(key) or key)
    for key in ("brachium/gym/*/imu/forearm_r", "brachium/gym", "elsewhere/gym/p01/event", ""):
        heard.see(key)
    assert declared == []


def test_no_more_keys_are_declared_than_are_held() -> None:
    declared: list[str] = []
    heard = HeardKeys(lambda key: declared.append(key) or key)
    for number in range(MOST_KEYS + 10):
        heard.see(keys.event("gym", f"p{number}"))
    heard.see(keys.event("gym", "p0"))
    assert len(declared) == MOST_KEYS
