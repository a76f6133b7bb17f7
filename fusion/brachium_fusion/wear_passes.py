"""What sensors sent during a wear check, and when what was asked for, to its findings. Pure."""

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import msgspec
import numpy as np

from brachium_body import rotation
from brachium_body.segments import SEGMENTS, Segment, Side, side_of
from brachium_fusion import from_capture
from brachium_fusion.calibrated import Calibrated
from brachium_fusion.uniform import Series, on_grid
from brachium_fusion.wear_check import WearCheck, WearPass, check_wear
from brachium_fusion.wear_features import Motion, WearRecord
from brachium_wire import keys
from brachium_wire.capture import Capture
from brachium_wire.codec import WireError, decode_batch, decode_topic
from brachium_wire.messages import Info
from brachium_wire.samples import Samples, read_samples
from brachium_wire.sensor_records import WearFound
from brachium_wire.topics import TOPICS

SLOWEST_HZ = 12.0
"""Movements of 3 Hz are looked at; a slower sensor cannot tell them."""


class CannotTell(RuntimeError):
    """Why nothing can be said, and what to do."""


class Sensor(NamedTuple):
    """One node's samples, calibrated; None if it sent no rates and accelerations."""

    info: Info
    series: Series | None


Sensors = dict[Segment, Sensor]


class Plan(NamedTuple):
    """What one arm was asked to do: spans in s, on the samples' clock."""

    moved: Side
    spans: Mapping[Motion, tuple[float, float]]


class Outcome(NamedTuple):
    """What a check says."""

    check: WearCheck
    left_out: dict[Segment, str]
    """Why a node was not checked."""
    assumed: tuple[Segment, ...]
    """Whose nominal mounting nobody told: sensor axes were taken for the segment's."""

    @property
    def fine(self) -> bool:
        """Return whether every node was checked and found as it should be."""
        return self.check.fine and not self.left_out


class Heard:
    """Collects one subject's infos and batches, from the bus or from a recording."""

    def __init__(self, infos: Mapping[str, Info] | None = None) -> None:
        self.infos: dict[str, Info] = dict(infos or {})
        self.newest_s: dict[str, float] = {}
        """Time of each segment's newest sample."""
        self.drops: Counter[str] = Counter()
        self._batches: dict[str, list[Samples]] = {}

    def take(self, place: keys.Key, payload: bytes) -> None:
        """Take one message; what breaks the contract is counted and dropped."""
        segment = place.detail
        try:
            if place.topic == "info":
                info = decode_topic(payload, "info")
                if isinstance(info, Info):
                    self.infos[segment] = info
            elif place.topic == "imu":
                samples = read_samples(decode_batch(payload, TOPICS["imu"].max_bytes))
                self._batches.setdefault(segment, []).append(samples)
                newest = 1e-9 * samples.time_ns[-1]
                self.newest_s[segment] = max(newest, self.newest_s.get(segment, newest))
        except WireError as error:
            self.drops[error.drop.value] += 1

    def sensors(self) -> Sensors:
        """Return what came, by segment; without an info nothing is known of a sensor."""
        return {
            segment: Sensor(self.infos[segment], _series(self.infos[segment], self._batches.get(segment, [])))
            for segment in SEGMENTS
            if segment in self.infos
        }


def of_capture(capture: Capture) -> Sensors:
    """Return a capture folder's sensors."""
    sensors: Sensors = {}
    infos = from_capture.infos(capture)
    for segment, data in capture.segments.items():
        info, series = infos[segment], None
        if data.gyr is not None and data.acc is not None:
            calibrated = Calibrated(info.calibration)
            gyr, acc = calibrated.gyr(data.gyr), calibrated.acc(data.acc)
            series = Series(time_s=data.t, rate_hz=data.rate_hz, gyr=gyr, acc=acc)
        sensors[segment] = Sensor(info, series)
    return sensors


def extent(sensors: Sensors) -> tuple[float, float]:
    """Return the times of the first and the last sample, s; raises CannotTell if there are none."""
    times = [s.series.time_s for s in sensors.values() if s.series is not None]
    if not times:
        raise CannotTell("no sensor sent angular rates and accelerations; the check needs both")
    return min(float(t[0]) for t in times), max(float(t[-1]) for t in times)


def examine(sensors: Sensors, plans: Sequence[Plan]) -> Outcome:
    """Return what the check finds: of the nodes named for the arms that were asked, and the trunk's."""
    asked = {plan.moved for plan in plans}
    chosen: Sensors = {
        name: s for name, s in sensors.items() if side_of(name) is None or side_of(name) in asked
    }
    left_out: dict[Segment, str] = {name: why for name, sensor in chosen.items() if (why := _unfit(sensor))}
    used: Sensors = {name: s for name, s in chosen.items() if name not in left_out}
    assumed: tuple[Segment, ...] = tuple(n for n, s in used.items() if s.info.mounting is None)
    try:
        check = _check(used, plans)
    except CannotTell as refusal:
        check = WearCheck(findings=(), refused=str(refusal))
    return Outcome(check, left_out, assumed)


def findings(outcome: Outcome) -> list[WearFound]:
    """Return the findings as they are told."""
    return [
        WearFound(segment=f.segment, seat=f.seat, turn=f.turn, fine=f.fine, text=f.text)
        for f in outcome.check.findings
    ]


def plain(outcome: Outcome) -> dict[str, Any]:
    """Return what a check says as plain values: what `wear-check` is answered with."""
    return {
        "fine": outcome.fine,
        "refused": outcome.check.refused,
        "findings": [msgspec.structs.asdict(finding) for finding in findings(outcome)],
        "left_out": dict(outcome.left_out),
        "mounting_assumed": list(outcome.assumed),
    }


def wear_pass(sensors: Sensors, plan: Plan, rate_hz: float) -> WearPass:
    """Return one arm's pass on a uniform grid; raises CannotTell naming who was silent in it.

    The rows of the three spans follow one another, whatever lay between them.
    """
    grids, rows, first = [], dict[Motion, tuple[int, int]](), 0
    for motion, (from_s, to_s) in plan.spans.items():
        grids.append(from_s + np.arange(round((to_s - from_s) * rate_hz)) / rate_hz)
        rows[motion] = (first, first + len(grids[-1]))
        first = rows[motion][1]
    times = np.concatenate(grids)
    records: dict[Segment, WearRecord] = {}
    for segment, (info, series) in sensors.items():
        if series is None:
            continue
        even = on_grid(series, times)
        if even.missing.any():
            silent_s = float(even.missing.sum()) / rate_hz
            raise CannotTell(
                f"{segment} was silent for {silent_s:.1f} s of the check: look at its battery and radio "
                "(brachium monitor), and repeat the check"
            )
        mounting = rotation.IDENTITY if info.mounting is None else np.array(info.mounting)
        records[segment] = WearRecord(gyr=even.gyr, acc=even.acc, nominal_mounting=mounting)
    return WearPass(moved=plan.moved, records=records, spans=rows)


def _check(used: Sensors, plans: Sequence[Plan]) -> WearCheck:
    named = {side_of(name) for name in used}
    for plan in plans:
        if plan.moved not in named:
            raise CannotTell(f"no node that can be checked is named for the {plan.moved} arm")
    rate_hz = max(s.series.rate_hz for s in used.values() if s.series is not None)
    return check_wear([wear_pass(used, plan, rate_hz) for plan in plans], rate_hz)


def _unfit(sensor: Sensor) -> str:
    if sensor.info.orientation_only:
        return "sends orientations only; the check needs angular rates and accelerations"
    if sensor.series is None:
        return "is silent: switch it on, or look at its radio (brachium monitor)"
    if sensor.series.rate_hz < SLOWEST_HZ:
        return f"sends {sensor.series.rate_hz:g} samples a second; the check needs {SLOWEST_HZ:g}"
    return ""


def _series(info: Info, batches: Sequence[Samples]) -> Series | None:
    """Return all samples in order of time, each instant once; None if there are not two."""
    whole = [(b.time_ns, b.gyr, b.acc) for b in batches if b.gyr is not None and b.acc is not None]
    if not whole:
        return None
    came_s = np.concatenate([np.array(t, dtype=np.float64) for t, _, _ in whole]) * 1e-9
    times_s, order = np.unique(came_s, return_index=True)
    if len(times_s) < 2:
        return None
    calibrated = Calibrated(info.calibration)
    return Series(
        time_s=times_s,
        rate_hz=info.rate_hz,
        gyr=calibrated.gyr(np.concatenate([gyr for _, gyr, _ in whole])[order]),
        acc=calibrated.acc(np.concatenate([acc for _, _, acc in whole])[order]),
    )
