"""Straps that slip by 8 deg in a session: found within a minute, on the right sensor, and nowhere else."""

from dataclasses import dataclass, replace

import numpy as np

from brachium.evaluation.context import Context
from brachium.evaluation.tables import Cell, Limit, Table, middle
from brachium_body import rotation
from brachium_body.segments import Segment, arm_segments
from brachium_fusion.joint_model import Joint
from brachium_fusion.orientation import make
from brachium_fusion.strap_slip import Slip, SlipWatch
from brachium_fusion.timeline import Motion, SensorNow
from brachium_nodes.sensors import LEVELS
from brachium_nodes.session import SessionArrays, session_arrays
from brachium_nodes.wearer import WearerSettings
from brachium_nodes.wearing import Wearing

RATE_HZ = 25.0
SLIP_S, WITHIN_S, SLIP_DEG = 20.0, 60.0, 8.0
RESTING = ("reaching", "shrugging", "drinking", "forearm-rotation")
"""Exercises whose rests come back; in free movement each pause is another posture."""
EXERCISES = (*RESTING, "free")
SEGMENTS = arm_segments("right")


@dataclass(frozen=True, slots=True)
class Watched:
    """What was said of one session."""

    found: bool
    """The slip was told, of the right sensor, within WITHIN_S."""
    delay_s: float | None
    wrong: bool
    """A slip was told of another sensor, or before any."""


def watch(exercise: str, slips: Segment | None, seed: int) -> Watched:
    """Return what the watch says of a session in which one strap slips, or none."""
    errors = replace(LEVELS["typical"], slip_deg=SLIP_DEG if slips else 0.0)
    settings = WearerSettings(
        exercise=exercise,
        level="typical",
        errors=errors,
        wearing=Wearing(slip_segment=slips, slip_s=SLIP_S),
        seed=seed,
        rate_hz=RATE_HZ,
    )
    session = session_arrays(settings, SLIP_S + WITHIN_S)
    told = slips_of(session)
    right = [s for s in told if s.segment == slips and s.found_ns >= SLIP_S * 1e9]
    delay = 1e-9 * right[0].found_ns - SLIP_S if right else None
    return Watched(bool(right), delay, len(told) > len(right[:1]))


def slips_of(session: SessionArrays) -> list[Slip]:
    """Return the slips that the watch tells, with orientations of the live filter and the joints' axes as the
    pose gives them."""
    from_segment = {s: rotation.inverse(x.segment_from_sensor[0]) for s, x in session.sensors.items()}
    x, y, z = np.eye(3)
    upper, fore, hand = SEGMENTS
    joints = [
        Joint(
            axes=2,
            axis_a=rotation.rotate(from_segment[near], z),
            axis_b=rotation.rotate(from_segment[far], axis),
            lever_a=None,
            lever_b=None,
        )
        for near, far, axis in ((upper, fore, y), (fore, hand, x))
    ]
    quats = {
        name: make("auto", 1.0 / RATE_HZ, True).update(sensor.gyr, sensor.acc, sensor.mag, None)
        for name, sensor in session.sensors.items()
    }
    looking = SlipWatch(SEGMENTS, RATE_HZ, joints)
    told: list[Slip] = []
    for k, t in enumerate(session.time_s.tolist()):
        now: dict[str, SensorNow] = {
            s: SensorNow(quats[s][k], Motion(v.gyr[k], v.acc[k])) for s, v in session.sensors.items()
        }
        slip = looking.step(round(t * 1e9), now)
        if slip is not None:
            told.append(slip)
    return told


def slip(context: Context) -> list[Table]:
    """Return, by exercise, how many slips were found in time, how soon, and how often wrongly."""
    rows: list[tuple[str, tuple[Cell, ...]]] = []
    found: list[bool] = []
    false: list[bool] = []
    seeds = context.seeds[:1] if context.quick else context.seeds[:2]
    for exercise in EXERCISES:
        context.progress(f"slip: {exercise}")
        slipped = [watch(exercise, segment, seed) for segment in SEGMENTS for seed in seeds]
        held = [watch(exercise, None, seed) for seed in seeds]
        rows.append(
            (
                exercise,
                (
                    100.0 * float(np.mean([w.found for w in slipped])),
                    middle([w.delay_s for w in slipped]),
                    100.0 * float(np.mean([w.wrong for w in slipped])),
                    100.0 * float(np.mean([w.wrong for w in held])),
                ),
            )
        )
        found += [w.found for w in slipped if exercise in RESTING]
        false += [w.wrong for w in held]
    share, alarms = 100.0 * float(np.mean(found)), 100.0 * float(np.mean(false))
    rows.append(("all with rests that come back", (share, None, None, alarms)))
    return [
        Table(
            name="slip",
            title="A strap that slips by 8 deg, typical",
            unit="",
            columns=("found within 60 s, %", "after, s", "another told, %", "told where none slipped, %"),
            rows=tuple(rows),
            limits=(
                Limit(
                    what="found within 60 s, where rests come back",
                    value=share,
                    at_most=100.0,
                    unit="%",
                    at_least=True,
                ),
                Limit(what="told where none slipped", value=alarms, at_most=1.0, unit="%"),
            ),
            notes=(
                "Upper arm, forearm and hand, each slipping once, about a random axis. A turn about the "
                "vertical of every rest is not to be seen; in free movement each pause is another posture. "
                f"Seeds {', '.join(map(str, seeds))}.",
            ),
        )
    ]
