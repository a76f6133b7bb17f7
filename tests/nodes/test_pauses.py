"""How long emulated nodes wait before they connect again: the firmware's rule, and nobody in step."""

import re
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

import brachium_nodes
from brachium_nodes.pauses import FIRST_S, LONGEST_S, STEADY_S, Pauses

NODES = st.text(min_size=1, max_size=30)
SHORT_S = 0.5 * STEADY_S


def cut_off(pauses: Pauses, times: int, now_s: float = 0.0) -> list[float]:
    """Return the waits of a node that was let in once and finds no gateway any more."""
    pauses.joined(now_s)
    return [pauses.next_s(now_s + SHORT_S) for _ in range(times)]


@given(node=NODES)
def test_it_waits_twice_as_long_each_time_half_of_it_by_chance(node: str):
    for number, wait_s in enumerate(cut_off(Pauses(node), 12)):
        middle_s = min(FIRST_S * 2**number, LONGEST_S)
        assert 0.5 * middle_s <= wait_s <= 1.5 * middle_s


@given(node=NODES)
def test_a_run_repeats(node: str):
    assert cut_off(Pauses(node), 5) == cut_off(Pauses(node), 5)


def test_a_hundred_nodes_behind_one_gateway_do_not_come_back_in_step():
    all_of_them = [Pauses(f"wearer-{number}") for number in range(100)]
    times = [0.0] * len(all_of_them)
    spread = []
    for pauses in all_of_them:
        pauses.joined(0.0)
    for _ in range(4):
        times = [t + pauses.next_s(SHORT_S) for t, pauses in zip(times, all_of_them, strict=True)]
        busiest = max(sum(t <= u < t + 0.1 for u in times) for t in times)
        spread.append(busiest)
    assert max(spread) <= 40  # in step it would be 100
    assert spread == sorted(spread, reverse=True)  # the later, the fewer at once
    assert spread[-1] <= 10


@given(node=NODES, times=st.integers(1, 10))
def test_who_was_welcome_for_a_while_is_soon_back(node: str, times: int):
    pauses = Pauses(node)
    cut_off(pauses, times)
    pauses.joined(100.0)
    assert pauses.next_s(100.0 + STEADY_S + 0.1) <= 1.5 * FIRST_S
    pauses.joined(200.0)
    assert pauses.next_s(200.0 + SHORT_S) >= FIRST_S  # not welcome for long: it goes on growing


@given(node=NODES, times=st.integers(1, 50))
def test_before_the_first_welcome_nothing_grows(node: str, times: int):
    pauses = Pauses(node)
    assert max(pauses.next_s(float(i)) for i in range(times)) <= 1.5 * FIRST_S


@pytest.mark.parametrize(("wanted_s", "least_s"), [(5.0, 5.0), (1000.0, LONGEST_S)])
def test_what_the_gateway_asks_for_is_waited_at_least(wanted_s: float, least_s: float):
    pauses = Pauses("n1")
    pauses.joined(0.0)
    assert pauses.next_s(SHORT_S, wanted_s) == least_s


def test_the_figures_are_the_firmwares():
    firmware = Path(brachium_nodes.__file__).parent / "firmware"
    node = (firmware / "node.py").read_text("utf-8")
    found = {name: int(value) for name, value in re.findall(r"^(_\w+_MS) = (\d+)", node, re.MULTILINE)}
    assert found["_FIRST_PAUSE_MS"] == 1000 * FIRST_S
    assert found["_STEADY_MS"] == 1000 * STEADY_S
    assert "pause // 2 + random.randrange(pause)" in node  # from half a pause to one and a half
    assert f'"longest_pause_s": {LONGEST_S:g},' in (firmware / "configuration.py").read_text("utf-8")
