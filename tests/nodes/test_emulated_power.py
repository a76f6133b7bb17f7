"""The emulated battery and radio: seeded, plausible, and the battery only falls."""

from hypothesis import given
from hypothesis import strategies as st

from brachium_body.segments import SEGMENTS
from brachium_nodes.emulated_power import EMPTY_V, FULL_V, EmulatedPower

HOUR_S = 3600.0
powers = st.builds(EmulatedPower.draw, st.integers(0, 2**32), st.sampled_from(sorted(SEGMENTS)))
times = st.floats(0.0, 48 * HOUR_S)


@given(powers, times, times)
def test_the_battery_falls_slowly_to_empty_and_the_signal_is_a_room_s(power, a, b) -> None:
    early, late = power.status(min(a, b)), power.status(max(a, b))
    assert FULL_V[1] >= early.battery_v >= late.battery_v >= EMPTY_V
    assert early.battery_v - late.battery_v <= 0.1 * abs(b - a) / HOUR_S + 0.001
    assert early.battery_hours - late.battery_hours <= abs(b - a) / HOUR_S + 0.011
    for said in (early, late):
        assert (said.battery_hours <= 0.01) == (said.battery_v <= EMPTY_V + 0.001)
        assert -85.0 <= said.rssi_dbm <= -30.0
        assert said.rssi_dbm == round(said.rssi_dbm)
        assert said.dropped is None


@given(powers)
def test_it_falls_measurably_within_an_hour_and_lasts_some_hours(power) -> None:
    full = power.status(0.0).battery_v
    assert power.status(HOUR_S).battery_v < full - 0.05
    assert power.status(5 * HOUR_S).battery_v > EMPTY_V


def test_each_seed_and_segment_has_its_own_and_the_same_again() -> None:
    drawn = {EmulatedPower.draw(seed, segment) for seed in (1, 2) for segment in ("hand_r", "forearm_r")}
    assert len(drawn) == 4
    assert EmulatedPower.draw(1, "hand_r") in drawn
    signals = [EmulatedPower.draw(1, "hand_r").status(second).rssi_dbm for second in range(60)]
    assert len(set(signals)) > 4
    assert signals == [EmulatedPower.draw(1, "hand_r").status(second + 0.5).rssi_dbm for second in range(60)]
