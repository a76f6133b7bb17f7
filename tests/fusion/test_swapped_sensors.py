"""Two sensors of an arm in each other's place are told from a led movement; nothing is said of worn ones."""

import numpy as np
import pytest

from brachium_fusion.segment_records import SensorRecord, Span
from brachium_fusion.sensor_to_segment import align_segments
from brachium_fusion.swapped_sensors import swapped
from brachium_nodes.session import SessionArrays, session_arrays
from brachium_nodes.wearer import WearerSettings

RATE = 25.0


def led(side: str, level: str, **more) -> tuple[SessionArrays, list[Span]]:
    """Return a session of the calibration routine, and its spans as rows."""
    settings = WearerSettings(
        routine="calibration", arms=side, level=level, seed=4, rate_hz=RATE,  # type: ignore[arg-type]
        segments=(f"upper_arm_{side[0]}", f"forearm_{side[0]}"), **more,
    )  # fmt: skip
    session = session_arrays(settings, 42.0)
    kinds = ("n-pose", "elbow-flexion", "pronation", "free")
    return session, [
        Span(kind=s.kind, first=round(s.from_s * RATE), end=round(s.to_s * RATE))  # type: ignore[arg-type]
        for s in session.spans
        if s.kind in kinds
    ]


def records(session: SessionArrays, names: dict[str, str] | None = None) -> dict[str, SensorRecord]:
    return {
        (names or {}).get(name, name): SensorRecord(world_from_sensor=one.world_from_sensor, acc=one.acc)
        for name, one in session.sensors.items()
    }


@pytest.mark.parametrize("side", ["right", "left"])
def test_swapped_sensors_are_named(side: str) -> None:
    session, spans = led(side, "typical")
    upper, forearm = f"upper_arm_{side[0]}", f"forearm_{side[0]}"
    (warning,) = swapped(records(session, {upper: forearm, forearm: upper}), spans)
    assert warning.startswith(f"{upper} turned by ")
    assert "seem to be swapped" in warning
    alignment = align_segments(records(session, {upper: forearm, forearm: upper}), spans, RATE)
    assert warning in alignment.warnings


@pytest.mark.parametrize("level", ["ideal", "typical", "patient"])
@pytest.mark.parametrize("side", ["right", "left"])
def test_worn_sensors_are_left_in_peace(side: str, level: str) -> None:
    session, spans = led(side, level)
    assert swapped(records(session), spans) == []


def test_without_a_led_flexion_nothing_is_sure() -> None:
    session, spans = led("right", "ideal")
    others = [span for span in spans if span.kind != "elbow-flexion"]
    exchanged = records(session, {"upper_arm_r": "forearm_r", "forearm_r": "upper_arm_r"})
    assert swapped(exchanged, others) == []
    still = Span(kind="elbow-flexion", first=spans[0].first, end=spans[0].end)
    assert swapped(exchanged, [*others, still]) == []
    assert np.isfinite(exchanged["forearm_r"].world_from_sensor).all()
