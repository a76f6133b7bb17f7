"""A span of an emulated session as arrays on one grid: every sensor's readings, and what was really so.

All sensors are sampled at the same instants `k / rate_hz`: no clock skew, no packets, nothing lost. Noise and
drift are those of the same wearer's sample number k, so spans of one session agree where they overlap.
"""

from collections.abc import Collection
from dataclasses import dataclass, replace
from typing import Literal, get_args

import numpy as np

from brachium_body import rotation
from brachium_body.angles import COLUMNS
from brachium_body.lengths import ArmLengths
from brachium_body.segments import SIDES, Segment, Side
from brachium_nodes.motions import DEG
from brachium_nodes.movement import Array
from brachium_nodes.noise import Noise
from brachium_nodes.script import Span
from brachium_nodes.sensors import calibrated
from brachium_nodes.truth import Truth
from brachium_nodes.wearer import Wearer, WearerSettings
from brachium_wire.messages import SensorCalibration

Reading = Literal["acc", "gyr", "mag"]
READINGS: tuple[Reading, ...] = get_args(Reading)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SensorArrays:
    """One sensor at n instants. What stands behind `calibration` is the truth, unknown to a tracker."""

    gyr: Array
    """(n, 3) rad/s in sensor axes."""
    acc: Array
    """(n, 3) m/s^2, specific force: +g upwards at rest."""
    mag: Array
    """(n, 3) uT."""
    nominal_mounting: Array
    """segment_from_sensor (4,) as it should have been put on."""
    calibration: SensorCalibration
    """Makes calibrated readings of raw ones."""
    world_from_sensor: Array
    """(n, 4), with skin, strap and slip, without the skin's wobble."""
    segment_from_sensor: Array
    """(n, 4): the mounting as it really is at each instant, on the segment that the sensor really sits on."""
    levers: dict[str, Array]
    """From the sensor to each joint of its segment (3,) m in sensor axes as put
    on; the sternum's to the chest, shoulder_r and shoulder_l of a person with still girdle."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ArmArrays:
    """What one arm really does at n instants."""

    world_from_segment: dict[str, Array]
    """By segment, with the sternum: (n, 4)."""
    world_positions: dict[str, Array]
    """shoulder, elbow, wrist, hand (the tip) in world axes from the chest as it was in neutral: (n, 3) m."""
    trunk_positions: dict[str, Array]
    """The same in trunk axes from the chest: (n, 3) m."""
    angles: dict[str, Array]
    """By angles.COLUMNS: (n,) rad, unwrapped."""
    shoulder_shift: Array
    """(n, 3) m in trunk axes: the girdle alone."""
    trunk_from_world: Array
    """(n, 4)."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SessionArrays:
    """Readings and truth of one session on the grid `time_s`."""

    settings: WearerSettings
    time_s: Array
    """(n,) true time: 0 is the beginning of standing in neutral."""
    lengths: ArmLengths
    spans: tuple[Span, ...]
    """What is done when before the exercise, in true time whatever the arrays' own span is."""
    slip: tuple[Segment, float] | None
    """Which strap slips, and when in s."""
    carrying: float
    """rad, ISB's sign: valgus negative."""
    sensors: dict[Segment, SensorArrays]
    arms: dict[Side, ArmArrays]


def session_arrays(
    settings: WearerSettings, to_s: float, from_s: float = 0.0, *, raw: bool | Collection[Reading] = False
) -> SessionArrays:
    """Return the samples k / rate_hz in [from_s, to_s) and their truth.

    `raw` readings are uncalibrated: all of them, or those named.
    Raises ValueError for a span without samples.
    """
    first, end = round(from_s * settings.rate_hz), round(to_s * settings.rate_hz)
    if not 0 <= first < end:
        raise ValueError(f"no samples lie between {from_s} and {to_s} s; give times from 0 on, in order")
    wearer, t = Wearer(settings), np.arange(first, end) / settings.rate_hz
    sides: tuple[Side, ...] = SIDES if settings.arms == "both" else (settings.arms,)
    truths: dict[Side, Truth] = {side: wearer.truth(t, side) for side in sides}
    arms: dict[Side, ArmArrays] = {side: _arm(wearer, t, truth) for side, truth in truths.items()}
    return SessionArrays(
        settings=settings,
        time_s=t,
        lengths=replace(wearer.person.lengths, relative_sd=0.0),
        spans=wearer.person.spans,
        slip=wearer.slip,
        carrying=-settings.carrying_deg * DEG,
        sensors={s: _sensor(wearer, s, first, t, truths, raw=raw) for s in wearer.segments},
        arms=arms,
    )


def _sensor(
    wearer: Wearer,
    segment: Segment,
    first: int,
    t: Array,
    truths: dict[Side, Truth],
    *,
    raw: bool | Collection[Reading],
) -> SensorArrays:
    strap, chip, made = wearer.straps[segment], wearer.chips[segment], wearer.settings
    white, drift = Noise(wearer.errors, made.seed, segment, made.rate_hz).span(first, len(t))
    true = strap.truth(t, 1.0 / made.rate_hz, wearer.person)
    read = chip.read(*true, made.rate_hz, drift, white)
    left: Collection[Reading] = () if raw is False else READINGS if raw is True else raw
    done = calibrated(chip.calibration, *read)
    acc, gyr, mag = (r if name in left else c for name, r, c in zip(READINGS, read, done, strict=True))
    told = [truth for truth in truths.values() if segment in truth.world_from_sensor]
    truth = told[0] if told else wearer.truth(t, "right" if strap.seat.endswith("_r") else "left")
    world_from_sensor = truth.world_from_sensor[segment]
    sensor_from_segment = rotation.inverse(strap.placement)
    return SensorArrays(
        gyr=gyr,
        acc=acc,
        mag=mag,
        nominal_mounting=np.array(strap.nominal),
        calibration=chip.calibration,
        world_from_sensor=world_from_sensor,
        segment_from_sensor=rotation.multiply(
            rotation.inverse(truth.world_from_segment[strap.seat]), world_from_sensor
        ),
        levers={
            joint: rotation.rotate(sensor_from_segment, at - np.array(strap.place.lever))
            for joint, at in _joints(strap.seat, wearer.person.lengths).items()
        },
    )


def _joints(segment: Segment, lengths: ArmLengths) -> dict[str, Array]:
    """Return the joints of a segment (3,) m in its axes, from the one its sensor's place counts from."""
    if segment == "sternum":
        return {
            "chest": np.zeros(3),
            "shoulder_r": np.array([0.0, 0.0, lengths.chest_to_shoulder]),
            "shoulder_l": np.array([0.0, 0.0, -lengths.chest_to_shoulder]),
        }
    part = segment[:-2]
    near, far = {
        "upper_arm": ("shoulder", "elbow"),
        "forearm": ("elbow", "wrist"),
        "hand": ("wrist", "hand"),
    }[part]
    return {near: np.zeros(3), far: np.array([0.0, -getattr(lengths, part), 0.0])}


def _arm(wearer: Wearer, t: Array, truth: Truth) -> ArmArrays:
    chest = wearer.person.trunk(t).chest - wearer.person.trunk(np.zeros(1)).chest
    world_from_trunk = rotation.inverse(truth.trunk_from_world)
    return ArmArrays(
        world_from_segment=truth.world_from_segment,
        world_positions={
            name: chest + rotation.rotate(world_from_trunk, p) for name, p in truth.positions.items()
        },
        trunk_positions=truth.positions,
        angles={name: np.unwrap(truth.angles[:, i]) for i, name in enumerate(COLUMNS)},
        shoulder_shift=truth.shoulder_shift,
        trunk_from_world=truth.trunk_from_world,
    )
