"""A chip in hands that do what they are told: its errors are found; what is done badly is refused by name."""

import re
from collections.abc import Callable
from itertools import pairwise

import msgspec
import numpy as np
import pytest

from brachium_body import rotation
from brachium_fusion.calibrated import Calibrated
from brachium_fusion.sensor_guide import SensorGuide, as_float32, steps_for
from brachium_fusion.sensor_steps import Faces
from brachium_fusion.turn_step import COVERED, Turn
from brachium_nodes.bench_hands import Hands, Mistake
from brachium_nodes.calibration_bench import CalibrationBench
from brachium_nodes.emulate_bench import bench_packets
from brachium_nodes.sensors import FIELD_UT, Chip
from brachium_nodes.wearer import Wearer, WearerSettings
from brachium_wire.messages import Info, SensorCalibration
from brachium_wire.samples import Samples
from brachium_wire.sensor_records import SensorProgress

SEGMENT = "forearm_r"
ALL = ["rest", "faces", "turn"]
LONGEST_S = 1000.0


def info(rate_hz: float = 50.0, **more: object) -> Info:
    return Info(
        **{"node": "n1", "rate_hz": rate_hz, "origin": "worn", "host": "gw", "magnetometer": True} | more
    )


def guided(
    mistake: Mistake = "",
    seed: int = 1,
    steps: list | None = None,
    rate_hz: float = 50.0,
    changed: Callable[[Samples], Samples] = lambda s: s,
    **more: object,
) -> tuple[SensorGuide, list[SensorProgress]]:
    """Return a guide that came to its end, and all that it told."""
    settings = WearerSettings(level="typical", seed=seed, rate_hz=rate_hz, batch=10, segments=(SEGMENT,))
    guide, told = SensorGuide(SEGMENT, info(rate_hz, **more), steps or ALL), []
    hands = Hands(seed, SEGMENT, mistake)
    for packet in bench_packets(Wearer(settings), SEGMENT, hands, lambda: guide.progress().step):
        assert packet.due_s < LONGEST_S, told[-1]
        batch = packet.batch
        block = {
            name: np.frombuffer(getattr(batch, name), "<f4").reshape(-1, 3).astype(float)
            for name in ("acc", "gyr", "mag")
        }
        times = [int(1e9 * t) + 1 for t in packet.times_s]
        samples = Samples(
            sequence=batch.sequence, time_ns=times, device_us=0, device_offsets=b"", received_ns=times[-1],
            uncertainty_ns=0, mag_index=None, quat=None, late=False, **block,
        )  # fmt: skip
        if guide.take(changed(samples)):
            told.append(guide.progress())
        if guide.over:
            return guide, told
    raise AssertionError


def moved(samples: Samples, rates: object) -> Samples:
    return msgspec.structs.replace(samples, gyr=samples.gyr + np.asarray(rates))


def bench(seed: int) -> CalibrationBench:
    return CalibrationBench(
        WearerSettings(level="typical", seed=seed, rate_hz=50.0, segments=(SEGMENT,)), SEGMENT
    )


def mag_direction_deg(found: SensorCalibration, chip: Chip) -> float:
    """Return the largest angle between the field and what calibrated readings without noise show."""
    c = chip.calibration
    turns = rotation.normalize(np.random.default_rng(0).normal(size=(500, 4)))
    true = rotation.rotate(turns, FIELD_UT)
    raw = (true + chip.mag_bias) @ np.linalg.inv(np.array(c.mag_matrix)).T + np.array(c.mag_offset)
    seen = Calibrated(found).mag(raw)
    cosines = np.einsum("ij,ij->i", seen, true) / np.linalg.norm(seen, axis=1) / np.linalg.norm(true, axis=1)
    return float(np.degrees(np.arccos(np.clip(cosines, -1.0, 1.0))).max())


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_every_error_that_was_put_in_is_found(seed: int) -> None:
    guide, told = guided(seed=seed)
    found, true = guide.calibration(), bench(seed).perfect_calibration()
    assert guide.progress().state == "done"
    assert found is not None
    assert np.degrees(np.abs(np.subtract(found.gyro_bias, true.gyro_bias))).max() < 0.02
    assert np.abs(np.subtract(found.accel_bias, true.accel_bias)).max() < 0.01
    assert np.abs(np.subtract(found.accel_scale, true.accel_scale)).max() < 1e-3
    assert mag_direction_deg(found, bench(seed).chip) < 0.5
    untold = mag_direction_deg(SensorCalibration(), bench(seed).chip)
    assert untold > 10.0
    scores = guide.progress().scores
    assert scores["field_spread_part"] < 0.02 < scores["field_spread_before_part"]
    assert [t.step for t, u in pairwise(told) if t.step != u.step] == ["rest", "faces"]


def test_what_is_seen_is_told_as_it_comes() -> None:
    _, told = guided()
    faces = [t.faces for t in told if t.step == "faces"]
    assert [len(f) for f in faces] == sorted(len(f) for f in faces)
    assert max(map(len, faces)) >= 5
    turns = [t for t in told if t.step == "turn"]
    assert turns[-2].coverage >= COVERED - 0.1
    assert {len(t.cells) for t in turns} == {48}
    assert all(t.cells.count("#") == round(48 * t.coverage) for t in turns)
    assert any(t.lacks for t in turns)
    rest = [t.left_s for t in told if t.step == "rest" and t.still]
    assert rest == sorted(rest, reverse=True)


REFUSED: list[tuple[Mistake, str, str]] = [
    ("restless", "rest", "did not lie still|was moved"),
    ("four-faces", "faces", r"never pointed upwards: \+z, -z"),
    ("tilted", "faces", r"never pointed upwards: -z \([0-9]+ poses were too tilted"),
    ("one-axis", "turn", "covered [0-9]+ % of all directions, 85 % are needed"),
    ("iron", "turn", "away from iron"),
    ("magnet", "turn", "magnet"),
]


@pytest.mark.parametrize(("mistake", "step", "why"), REFUSED)
def test_what_is_done_badly_is_refused_by_name_and_the_rest_holds(
    mistake: Mistake, step: str, why: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Faces, "longest_s", 40.0)  # hands that never tire need not be watched for as long
    monkeypatch.setattr(Turn, "longest_s", 40.0)
    guide, told = guided(mistake)
    last = guide.progress()
    assert last.state == "refused"
    assert list(last.refused) == [step]
    assert re.search(why, last.refused[step]), last.refused[step]
    assert max(t.attempt for t in told if t.step == step) == 3
    found = guide.calibration()
    parts = {"rest": "gyro_bias", "faces": "accel_scale", "turn": "mag_matrix"}
    assert found is not None
    assert {name for name in parts if getattr(found, parts[name]) is not None} == set(parts) - {step}


def test_a_step_that_is_refused_once_is_done_again() -> None:
    shaken = iter(range(10_000))

    def shake(samples: Samples) -> Samples:
        if next(shaken) < 250:  # 50 s
            return moved(samples, 0.3 * np.random.default_rng(0).normal(size=samples.gyr.shape))
        return samples

    guide, told = guided(steps=["rest"], changed=shake)
    assert guide.progress().state == "done"
    assert [t.attempt for t in told][-1] == 2
    assert any("did not lie still" in t.refused.get("rest", "") for t in told)
    assert guide.progress().refused == {}


def test_a_gyroscope_that_warms_up_is_told_of() -> None:
    def warm(samples: Samples) -> Samples:
        seconds = np.array(samples.time_ns) * 1e-9
        return moved(samples, np.radians(0.04) * seconds[:, None])

    guide, _ = guided(steps=["rest", "faces"], changed=warm)
    assert (
        "drifted by 0." in guide.progress().refused["rest"]
        or "drifted by 1." in (guide.progress().refused["rest"])
    )
    found = guide.calibration()
    assert found is not None
    assert found.gyro_bias is None
    assert found.accel_scale is not None


def test_a_sensor_that_turns_evenly_does_not_rest() -> None:
    def turned(samples: Samples) -> Samples:
        return moved(samples, [0.0, 0.0, 1.0])

    guide, _ = guided(steps=["rest"], changed=turned)
    assert "turned evenly" in guide.progress().refused["rest"]
    assert guide.calibration() is None


def test_what_was_known_of_other_parts_stays() -> None:
    known = SensorCalibration(
        accel_scale=(1.1, 1.0, 1.0), accel_bias=(0.1, 0.0, 0.0), gyro_bias=(9.0, 9.0, 9.0)
    )
    found = guided(steps=["rest"], calibration=known)[0].calibration()
    assert found is not None
    assert found.accel_bias == as_float32(known).accel_bias
    assert np.abs(np.array(found.gyro_bias)).max() < 1.0
    assert found == as_float32(found)


def test_only_what_a_sensor_can_do_is_asked_for() -> None:
    assert steps_for(None, info()) == ALL
    assert steps_for(["turn", "rest"], info()) == ["rest", "turn"]
    assert steps_for(None, info(magnetometer=False)) == ["rest", "faces"]
    with pytest.raises(ValueError, match="has none"):
        steps_for(["turn"], info(magnetometer=False))
    with pytest.raises(ValueError, match="calibrates itself"):
        steps_for(None, info(orientation_only=True))
