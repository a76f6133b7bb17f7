"""Who may come in. Times are plain numbers: nothing here waits."""

import pytest

from brachium_viewer.web.door import (
    CODE_LENGTH,
    CODE_TRIES,
    FREE_TRIES,
    KEY_S,
    LONGEST_WAIT_S,
    Door,
    Wait,
    hosts,
    is_loopback,
    same_origin,
)


def test_a_pairing_code_works_once_and_the_next_one_is_told():
    told: list[str] = []
    door = Door(on_code=told.append)
    code = door.code
    assert code is not None
    assert len(code) == CODE_LENGTH
    key = door.enter(code, "a", 0.0)
    assert key is not None
    assert door.enter(code, "b", 1.0) is None
    assert told == [code, door.code]
    assert door.code != code


def test_a_code_may_be_written_in_groups_and_small_letters():
    door = Door()
    assert door.code is not None
    assert door.enter(f" {door.code[:4].lower()}-{door.code[4:].lower()} ", "a", 0.0) is not None


def test_a_password_works_for_every_screen_and_as_it_is_written():
    door = Door("Geheim 1")
    first, second = door.enter("Geheim 1", "a", 0.0), door.enter("Geheim 1", "b", 0.0)
    assert first != second
    assert door.knows(first, 1.0)
    assert door.knows(second, 1.0)
    assert door.enter("geheim 1", "a", 0.0) is None
    assert door.enter("", "a", 0.0) is None


def test_a_key_opens_for_a_day_of_work_and_an_invented_one_never():
    door = Door("x")
    key = door.enter("x", "a", 0.0)
    assert door.knows(key, KEY_S - 1.0)
    assert not door.knows(key, KEY_S + 1.0)
    assert not door.knows(None, 0.0)
    assert not door.knows("", 0.0)
    assert not door.knows("invented", 0.0)


def test_who_guesses_waits_longer_and_longer_and_holds_nobody_else_up():
    door, now_s, waits = Door("x"), 0.0, []
    for _ in range(FREE_TRIES):
        assert door.enter("wrong", "guesser", now_s) is None
    for _ in range(9):
        with pytest.raises(Wait) as wait:
            door.enter("x", "guesser", now_s)
        waits.append(wait.value.seconds)
        now_s += wait.value.seconds + 0.01
        assert door.enter("wrong", "guesser", now_s) is None
    assert waits == sorted(waits)
    assert waits[0] < waits[3] < LONGEST_WAIT_S == max(waits)
    assert door.enter("x", "somebody else", now_s) is not None
    assert door.enter("x", "guesser", now_s + LONGEST_WAIT_S + 1.0) is not None


def test_a_code_that_many_guessed_at_is_another_one():
    door = Door()
    code = door.code
    for number in range(CODE_TRIES):
        door.enter("wrong", f"address {number}", 0.0)
    assert door.code != code


def test_a_page_is_ours_only_under_an_address_of_ours():
    ours = hosts("127.0.0.1", 8080)
    assert ours == {"127.0.0.1:8080", "localhost:8080"}
    assert same_origin("http://127.0.0.1:8080", "127.0.0.1:8080", ours)
    assert not same_origin("http://evil.example", "127.0.0.1:8080", ours)
    assert not same_origin("http://evil.example", "evil.example", ours)
    assert not same_origin("http://localhost:8080", "127.0.0.1:8080", ours)
    assert not same_origin(None, "127.0.0.1:8080", ours)
    assert hosts("10.0.0.7", 80) == {"10.0.0.7:80", "10.0.0.7"}
    assert hosts("fd00::7", 8080) == {"[fd00::7]:8080"}


def test_loopback_is_told_from_what_others_reach():
    assert is_loopback("127.0.0.1")
    assert is_loopback("::1")
    assert is_loopback("localhost")
    assert not is_loopback("192.168.1.20")
    assert not is_loopback("0.0.0.0")
    assert not is_loopback("somewhere")
