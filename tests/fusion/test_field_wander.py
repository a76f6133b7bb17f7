"""A field that keeps its direction is told from one that iron, or a bad calibration, turns."""

from dataclasses import replace

import numpy as np
import pytest

from brachium_fusion.best_material import Material
from brachium_fusion.field_wander import MOST_WANDER, told_of, wander_rad, wandering
from brachium_fusion.pose import Alignment
from brachium_fusion.uniform import Series
from brachium_nodes.magnetism import Surroundings
from brachium_nodes.session import session_arrays
from brachium_nodes.wearer import WearerSettings
from brachium_wire.messages import Info, Session

MADE = WearerSettings(
    exercise="free",
    routine="calibration",
    level="patient",
    rate_hz=25.0,
    segments=("upper_arm_r", "forearm_r"),
)


def series(disturbance_ut: float, *, raw: bool = False) -> dict[str, Series]:
    made = replace(MADE, surroundings=Surroundings(disturbance_ut=disturbance_ut))
    arrays = session_arrays(made, 60.0, raw=("mag",) if raw else False)
    return {
        name: Series(time_s=arrays.time_s, rate_hz=25.0, gyr=one.gyr, acc=one.acc, mag=one.mag)
        for name, one in arrays.sensors.items()
    }


@pytest.mark.parametrize(
    ("disturbance_ut", "raw", "wanders"), [(0.0, False, False), (8.0, False, True), (0.0, True, True)]
)
def test_iron_and_bad_calibration_are_told_from_the_earths_field(disturbance_ut, raw, wanders):
    made = series(disturbance_ut, raw=raw)
    infos = {name: Info(node=name, rate_hz=25.0, origin="emulated", host="h") for name in made}
    found = wandering(Material(series=made, infos=infos, sequences={}, session=Session()))
    assert found == (["upper_arm_r", "forearm_r"] if wanders else [])


def test_gaps_and_missing_fields_tell_nothing():
    one = series(0.0)["forearm_r"]
    assert wander_rad(replace(one, mag=None)) == 0.0
    assert one.mag is not None
    holes = np.where((np.arange(len(one.mag)) % 7 < 3)[:, None], np.nan, one.mag)
    assert wander_rad(replace(one, mag=holes)) < MOST_WANDER


def test_a_person_is_told_which_sensors():
    told = told_of(Alignment(warnings=("before",)), ["forearm_r"])
    assert told is not None
    assert told.warnings[0] == "before"
    assert "wanders at forearm_r" in told.warnings[1]
    assert told_of(None, ["forearm_r"]) is None
