"""Figures for a person: rounded, with units."""

from dataclasses import dataclass, field

from hypothesis import given
from hypothesis import strategies as st

from brachium.figure_text import lines


@dataclass
class Inner:
    elbow_deg: float = 1.23456789
    kind: str = "jump"


@dataclass
class Figures:
    gateway_cpu: float = 0.12345678901234567
    gateway_cpu_windows: list[float] = field(default_factory=lambda: [0.1 + 0.2, 12345.678])
    gateway_cpu_s: float = 3.0
    covered: float = 0.98765
    samples: int = 123456
    drops: dict[str, int] = field(default_factory=dict)
    power_worst_s: dict[str, float] = field(default_factory=lambda: {"sync": 2 / 3})
    opens: bool = True
    worst_after_deg: float | None = None
    rounds: list[Inner] = field(default_factory=lambda: [Inner(), Inner(2.0, "drift")])


def test_figures_are_rounded_and_have_units_where_their_names_have_none():
    assert [" ".join(line.split()) for line in lines(Figures())] == [
        "gateway cpu 0.123 of one core",
        "gateway cpu windows 0.3, 12300 of one core",
        "gateway cpu s 3",
        "covered 0.988 of 1",
        "samples 123456",
        "drops none",
        "power worst s",
        "sync 0.667",
        "opens yes",
        "worst after deg none",
        "rounds 1",
        "elbow deg 1.23",
        "kind jump",
        "rounds 2",
        "elbow deg 2",
        "kind drift",
    ]


@given(st.floats(1e-3, 1e5))
def test_a_number_is_told_to_half_of_its_third_digit(value: float):
    (told,) = lines({"length_m": value})
    digits = told.split()[-1]
    assert abs(float(digits) - value) <= 0.0051 * value
    assert len(digits.replace(".", "").strip("0")) <= 3
