"""A person's arms without magnetometer: an elbow is an elbow, from whichever half minute it was learnt."""

import os
from pathlib import Path

import numpy as np
import pytest
from vqf import offlineVQF

from brachium_body import rotation
from brachium_body.angles import INDEX, joint_angles
from brachium_fusion.sensor_to_segment import SensorRecord, Span, align_segments
from brachium_wire import capture

pytestmark = pytest.mark.data

DATA = Path(os.environ.get("BRACHIUM_DATA", Path(__file__).parents[3] / "shared" / "data"))
RATE = 100.0


@pytest.fixture(scope="module")
def records() -> dict[str, SensorRecord]:
    folder = DATA / "human_arms"
    if not folder.is_dir():
        pytest.skip(f"no recording human_arms in {DATA}; set BRACHIUM_DATA to the folder that holds it")
    made = {}
    for segment, data in capture.load(folder).segments.items():
        if segment.startswith(("upper_arm", "forearm")):
            assert data.gyr is not None
            assert data.acc is not None
            gyr, acc = (np.ascontiguousarray(x, dtype=np.float64) for x in (data.gyr, data.acc))
            quats = offlineVQF(gyr, acc, None, 1.0 / RATE)["quat6D"]
            made[segment] = SensorRecord(world_from_sensor=quats, acc=acc)
    return made


@pytest.mark.parametrize("side", ["right", "left"])
def test_elbow_of_a_person(records, side):
    most = []
    for first, end in ((4000, 7000), (7000, 10000), (500, 3500)):
        free = Span(kind="free", first=first, end=end)
        found = align_segments(records, [Span(kind="n-pose", first=0, end=450), free], RATE)
        world = [
            rotation.multiply(
                rotation.multiply(rotation.about(2, found.heading[s]), records[s].world_from_sensor),
                rotation.inverse(found.mounting[s]),
            )
            for s in (f"upper_arm_{side[0]}", f"forearm_{side[0]}")
        ]
        elbow = rotation.multiply(rotation.inverse(world[0]), world[1])
        angles = np.degrees(joint_angles(rotation.IDENTITY, elbow, rotation.IDENTITY, side))
        flexion = angles[:, INDEX["elbow_flexion"]]
        assert np.mean((flexion >= -10.0) & (flexion <= 160.0)) >= 0.99
        assert found.joints[f"elbow_{side[0]}"].lever_far_m is not None
        most.append(float(np.percentile(flexion, 99.0)))
    assert max(most) - min(most) <= 8.0
