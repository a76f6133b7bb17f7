"""Emulated recordings of the tables: what is solved, what is true, and what does not count."""

from dataclasses import replace

import numpy as np
import pytest

from brachium.evaluation import optical, wear_tables, zhou_trial
from brachium.evaluation.arm_tables import angle_deg, place_mm, shoulder_mm
from brachium.evaluation.context import Context
from brachium.evaluation.emulated import Emulated, capture_settings
from brachium.evaluation.trials import GUIDED, Trial, stated_angles
from brachium_wire import capture

SHRUG = Trial(exercise="shrugging", level="ideal", seed=3, rate_hz=25.0, seconds=8.0)


def test_a_trial_is_written_as_a_capture_that_reads_back(tmp_path):
    made = Emulated(replace(SHRUG, routine=GUIDED, loss=0.1, burst=5))
    made.write(tmp_path / "c")
    found = capture.load(tmp_path / "c")
    assert set(found.segments) == {"upper_arm_r", "forearm_r"}
    assert found.settings.calibration.pose == "n-pose"
    assert [f.motion for f in found.settings.calibration.functional] == ["elbow-flexion", "pronation", "free"]
    assert set(found.settings.joint) == {"shoulder", "elbow"}
    n = len(made.session.time_s)
    for segment in found.segments.values():
        assert len(segment.t) == pytest.approx(0.9 * n, abs=10)


def test_live_follows_the_truth_and_its_figures_are_small():
    made = Emulated(SHRUG)
    found = made.solved("auto")
    assert angle_deg("elbow_flexion")(made, found) < 1.0  # type: ignore[operator]
    assert place_mm("wrist")(made, found) < 60.0  # type: ignore[operator]
    assert shoulder_mm(made, found) is not None
    assert made.counts.start == 150


def test_an_arm_that_trembles_on_skin_keeps_its_angles_though_samples_are_lost():
    """The sensors tip by 5 deg five times a second, which nothing takes away; headings must not follow."""
    made = Emulated(
        Trial(exercise="shoulder-impaired", level="typical", seed=2, seconds=9.0, loss=0.05, routine=GUIDED)
    )
    found = made.solved("auto")
    for angle, most in (("shoulder_flexion", 6.0), ("elbow_flexion", 6.0), ("forearm_pronation", 4.0)):
        error = angle_deg(angle)(made, found)
        assert error is not None
        assert error < most, angle


def test_what_is_assumed_for_a_missing_segment_does_not_count():
    made = Emulated(replace(SHRUG, loss=0.1, burst=10))
    found = made.solved("auto")
    gone = np.isnan(found.world_from_segment["forearm_r"][:, 0])
    assert gone.any()
    assert np.isnan(found.angles["elbow_flexion"][gone]).all()
    assert np.isfinite(found.angles["elbow_flexion"][~gone]).any()


def test_a_single_sensor_keeps_what_its_exercise_states():
    trial = Trial(
        exercise="wrist-flexion", level="ideal", seed=1, seconds=4.0, parts=("hand",),
        assumed_angles_deg=stated_angles("wrist-flexion"),
    )  # fmt: skip
    settings = capture_settings(Emulated(trial))
    assert settings.assumed_angles_deg == {"elbow_flexion": 90.0, "forearm_pronation": 0.0}
    assert settings.joint == {}


def test_a_second_set_of_sensors_feels_the_same_movement_and_errs_otherwise():
    first, second = Emulated(SHRUG), Emulated(replace(SHRUG, second_set=True))
    np.testing.assert_allclose(first.truth.shoulder_shift, second.truth.shoulder_shift)
    for segment, sensor in first.sensors().items():
        other = second.sensors()[segment]
        assert np.abs(sensor.acc - other.acc).max() > 0.05
        speeds = (np.linalg.norm(s.gyr, axis=1) for s in (sensor, other))
        assert np.corrcoef(*speeds)[0, 1] > 0.95


@pytest.mark.parametrize("side", ["right", "left"])
def test_the_optical_tracker_sees_the_arm_to_a_millimetre(side):
    made = Emulated(replace(SHRUG, exercise="reaching", side=side))
    seen = optical.track(made)
    for name, places in seen.places.items():
        error = places - made.truth.trunk_positions[name]
        assert 1e-5 < np.sqrt((error**2).sum(axis=1).mean()) < 1.5e-3
    for name, angle in seen.angles.items():
        error = np.degrees(angle - made.truth.angles[name])
        assert np.sqrt(np.mean(error[made.counts] ** 2)) < 1.0


def test_zhous_sensors_sit_where_they_are_worn():
    made = Emulated(replace(SHRUG, level="exact"))
    lengths = made.session.lengths
    above = (lengths.upper_arm - 0.04, lengths.forearm - 0.03)
    for sensor, along in zip(zhou_trial.sensors(made), above, strict=True):
        assert sensor.place_m[1] == pytest.approx(-along, abs=2e-3)
    cycles = zhou_trial.cycles(Emulated(replace(SHRUG, seconds=20.0)))
    assert np.all(np.abs(np.diff(cycles) - 100) < 20)


def test_a_context_makes_each_trial_once():
    context = Context(seeds=(1, 2, 3))
    assert context.emulated(SHRUG) is context.emulated(replace(SHRUG))
    assert context.over_seeds(lambda seed: {1: 5.0, 2: None, 3: 1.0}[seed]) == 3.0
    assert context.over_seeds_each(lambda seed: [float(seed), None]) == [2.0, None]


@pytest.mark.parametrize("number", [0, 1, 2, 3, 4])
def test_wearers_of_every_kind_are_named_rightly(number: int):
    worn = wear_tables.case(number)
    assert worn.kind == wear_tables.KINDS[number]
    assert wear_tables.named_rightly(worn, wear_tables.findings(worn))


def test_a_wearer_is_not_named_rightly_by_any_finding():
    worn, other = wear_tables.case(0), wear_tables.case(1)
    assert not wear_tables.named_rightly(worn, wear_tables.findings(other))
    assert not wear_tables.named_rightly(worn, ())
