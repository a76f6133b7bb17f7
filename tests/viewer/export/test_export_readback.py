"""Every format, both arms, through a reader that shares nothing with what wrote it but the format."""

from pathlib import Path

import pytest

from brachium.bench_exports import GAP_S, RATE_HZ, differences
from brachium.page_promises import WITH_ANGLES, WITH_PLACES
from brachium_viewer.export.formats import FORMATS
from brachium_wire.table import Table


@pytest.mark.parametrize("to", FORMATS)
def test_a_file_says_what_was_exported(to: str, result: Table, tmp_path: Path):
    found = differences(result, to, tmp_path)
    assert found["gaps_off"] == 0
    assert found["gaps"] > 0.5 * (GAP_S[1] - GAP_S[0]) * RATE_HZ
    assert found["numbers"] > 5 * len(result)
    if to in WITH_ANGLES:
        assert found["angle_deg"] < 0.1
        assert found["angles"] >= 12
    if to in WITH_PLACES:
        assert found["position_mm"] < 1.0
        assert found["places"] >= 6


def test_the_arms_move_and_the_left_one_has_a_gap(result: Table):
    for end in ("r", "l"):
        elbow = result.columns[f"elbow_flexion_{end}"]
        known = elbow[elbow == elbow]
        assert known.max() - known.min() > 60.0
    assert (result.columns["elbow_flexion_l"] != result.columns["elbow_flexion_l"]).sum() > 40
    assert (result.columns["elbow_flexion_r"] == result.columns["elbow_flexion_r"]).all()
