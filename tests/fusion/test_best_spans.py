"""Which rows calibrate a recording: what is stated, and all movement beside it."""

import numpy as np
import pytest

from brachium_fusion.best_material import Material, TimedSpan
from brachium_fusion.best_spans import rows_of_spans
from brachium_wire.messages import Session

RATE = 50.0
TIME_S = np.arange(1000) / RATE
POSE = TimedSpan(kind="n-pose", from_s=0.5, to_s=2.5)
BENT = TimedSpan(kind="elbow-flexion", from_s=4.0, to_s=6.0)
TURNED = TimedSpan(kind="pronation", from_s=6.5, to_s=8.0)
FREE = TimedSpan(kind="free", from_s=9.0, to_s=12.0)


@pytest.mark.parametrize(
    ("stated", "kinds"),
    [
        ((POSE,), ["n-pose", "free"]),
        ((POSE, BENT), ["n-pose", "elbow-flexion", "free"]),
        ((POSE, TURNED), ["n-pose", "pronation", "free"]),
        ((POSE, BENT, TURNED), ["n-pose", "elbow-flexion", "pronation"]),
        ((POSE, BENT, FREE), ["n-pose", "elbow-flexion", "free"]),
        ((), []),
    ],
)
def test_all_movement_makes_up_for_what_was_not_led(stated, kinds):
    material = Material(series={}, infos={}, sequences={}, session=Session(), spans=stated)
    spans = rows_of_spans(material, {}, TIME_S, RATE)
    assert [span.kind for span in spans] == kinds
    if FREE in stated:
        assert (spans[-1].first, spans[-1].end) == (450, 601)
    elif kinds and kinds[-1] == "free":
        assert (spans[-1].first, spans[-1].end) == (spans[0].end, len(TIME_S))
