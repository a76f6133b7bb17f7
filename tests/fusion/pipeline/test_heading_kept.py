"""Without a magnetometer an angle that rests on a heading is given only as long as something kept it."""

import numpy as np

from brachium_body import rotation
from brachium_body.angles import SHOULDER
from brachium_body.kinematics import TRUNK_FROM_NEUTRAL
from brachium_body.segments import arm_segments
from brachium_fusion.settings import Settings
from brachium_wire import keys
from brachium_wire.codec import encode
from brachium_wire.samples import write_samples

MS = 1_000_000
Messages = list[tuple[keys.Key, bytes]]


def inertial_messages(made, mounting, *, seconds: float, rate=20.0, gap=(0, 0)) -> Messages:
    """Sensors without magnetometer that hang still, sampled slowly so that long spans are cheap."""
    messages: Messages = []
    segments = list(mounting)
    head = made.info_messages(segments, mounting=mounting, orientation_only=False, rate_hz=rate)
    n = int(seconds * rate)
    for first in range(0, n, 40):
        for segment in segments:
            if segment == "forearm_r" and gap[0] <= first < gap[1]:
                continue
            times = made.sample_times(first, 40, rate)
            up = rotation.rotate(
                rotation.inverse(rotation.multiply(TRUNK_FROM_NEUTRAL, mounting[segment])), [0.0, 0.0, 9.81]
            )
            batch_ = write_samples(
                sequence=first,
                time_ns=times,
                device_us=[0] * 40,
                received_ns=times[-1] + MS,
                uncertainty_ns=0,
                acc=np.tile(up, (40, 1)),
                gyr=np.zeros((40, 3)),
            )
            messages.append((keys.Key("room", "p01", "imu", segment), encode(batch_)))
    return head + messages


ON_HEADING = [name for name in SHOULDER if name != "isb_elevation"]


def test_angles_that_rest_on_a_heading_are_withheld_when_nothing_kept_it_for_too_long(flow, made) -> None:
    mounting = dict.fromkeys(arm_segments("right"), rotation.IDENTITY)
    skeletons = flow.run(
        inertial_messages(made, mounting, seconds=700.0), Settings(filter="vqf", rate_hz=5.0)
    )
    # 2 deg after the pose, then 0.02 deg/s: 15 deg are passed after 650 s
    for skeleton in skeletons[20:]:
        age = (skeleton.time_ns - made.START) * 1e-9 - 3.0
        known = set(skeleton.angles)
        assert known.isdisjoint(ON_HEADING) == (age > 650.0), age
        assert {"isb_elevation", "elbow_flexion", "wrist_flexion"} <= known
    assert skeletons[-1].time_ns - made.START > 690 * 10**9


def test_a_filter_that_began_anew_without_magnetometer_has_lost_its_heading_and_says_so(flow, made) -> None:
    mounting = dict.fromkeys(arm_segments("right"), rotation.IDENTITY)
    skeletons = flow.run(inertial_messages(made, mounting, seconds=20.0, gap=(120, 240)))
    before = [s for s in skeletons if 3_200 * MS < s.time_ns - made.START < 5_900 * MS]
    after = [s for s in skeletons if s.time_ns - made.START > 12_100 * MS]
    assert {s.segments["forearm_r"].quality for s in before} == {"good"}
    assert {s.segments["forearm_r"].quality for s in after} == {"heading_assumed"}
    assert {s.segments["hand_r"].quality for s in after} == {"good"}
    assert {s.assumed.get("elbow_flexion") for s in after} == {"heading_assumed"}
