"""Records to what a page draws: plain dictionaries that become JSON. Degrees, because people read them. Pure.

A number whose quality is no measurement goes with that quality beside it; one that is not known is null.
"""

from typing import Any

import msgspec
import numpy as np

from brachium_body.ranges import FUNCTIONAL, REFERENCE, Range
from brachium_body.segments import part_of
from brachium_viewer.exercises import EXERCISES, Exercise, held_against
from brachium_viewer.health_records import NodeHealth
from brachium_viewer.marks import ExerciseBegins
from brachium_viewer.scene import lean
from brachium_viewer.web.running_set import Progress
from brachium_wire.battery import is_low
from brachium_wire.messages import Calibration, Quality, Session, Skeleton

ANGLES = (*REFERENCE, "isb_elevation")
"""What a page is told of: the angles with a reference, and the one that shoulder exercises are counted by."""

SLOW = 0.8
"""Of its nominal rate: a sensor whose samples come slower is called slow."""

Json = dict[str, Any]


def arm(skeleton: Skeleton, *, stale: bool) -> Json:
    """Return one arm as drawn; of a stale one only its last pose, no number."""
    return {
        "t": skeleton.time_ns / 1e6,
        "stale": stale,
        "origin": skeleton.origin,
        "trunk": [round(float(x), 4) for x in lean(skeleton)],
        "positions": {name: [round(x, 4) for x in at] for name, at in skeleton.positions.items()},
        "parts": {part_of(name): _quality(skeleton, name, stale) for name in skeleton.segments},
        "angles": {name: angle(skeleton, name, stale=stale) for name in ANGLES},
    }


def angle(skeleton: Skeleton, name: str, *, stale: bool = False) -> tuple[float | None, Quality]:
    """Return one angle, deg, and how far to trust it."""
    value = skeleton.angles.get(name)
    if value is None or stale:
        return None, "missing"
    return round(float(np.degrees(value)), 1) + 0.0, skeleton.assumed.get(name, "good")


def _quality(skeleton: Skeleton, segment: str, stale: bool) -> Quality:
    return "missing" if stale else skeleton.segments[segment].quality


def progress(found: Progress) -> Json:
    """Return where the running set stands."""
    rounded = {
        name: None if value is None else round(value, 1)
        for name, value in (("angle", found.angle_deg), ("last", found.last_deg), ("best", found.best_deg))
    }
    return {
        **rounded,
        "count": found.repetitions,
        "tries": found.tries,
        "over": found.over_limit,
        "done": found.done,
        "seconds": round(found.seconds, 1),
    }


def sensor(node: NodeHealth) -> Json:
    """Return one sensor's health as a page shows it."""
    return {
        "segment": node.segment,
        "node": node.node,
        "state": node.state,
        "origin": node.origin,
        "slow": node.nominal_hz is not None and node.rate_hz < SLOW * node.nominal_hz,
        "loss_percent": round(100.0 * node.loss),
        "battery_hours": None if node.battery_hours is None else round(node.battery_hours, 1),
        "battery_percent": None if node.battery_level is None else round(100.0 * node.battery_level),
        "battery_low": is_low(node.battery_hours),
        "rssi_dbm": node.rssi_dbm,
    }


def calibration(news: Calibration | None) -> Json | None:
    """Return what a page shows of a calibration."""
    if news is None:
        return None
    return {
        "state": news.state,
        "pose": news.pose,
        "motion": news.motion,
        "progress": round(news.progress, 3),
        "reason": news.reason,
        "forward": news.forward,
        "scores": {name: round(value, 2) for name, value in news.scores.items()},
        "warnings": news.warnings,
        "refused": news.refused,
        "moving": news.moving,
        "wear": None if news.wear is None else msgspec.to_builtins(news.wear),
    }


def session(told: Session | None) -> Json | None:
    """Return what is known of a subject's body."""
    if told is None:
        return None
    return {"side": told.side, "height_m": told.height_m, "lengths_m": told.lengths_m}


def running(begins: ExerciseBegins, from_ns: int) -> Json:
    """Return what the running set is."""
    row = EXERCISES.get(begins.exercise, EXERCISES["free"])
    return {"angle": row.angle, "rises": row.rises, "from": from_ns / 1e6, **plan(begins)}


def plan(meant: ExerciseBegins) -> Json:
    """Return what is to be done, or is."""
    return {
        "exercise": meant.exercise,
        "side": meant.side,
        "mode": meant.mode,
        "goal_deg": meant.goal_deg,
        "limit_deg": meant.limit_deg,
        "set": meant.set,
        "sets": meant.sets,
        "repetitions": meant.repetitions,
    }


def hello(room: str) -> Json:
    """Return what a page is told once: what never changes while the server runs."""
    return {
        "kind": "hello",
        "room": room,
        "exercises": [_exercise(row) for row in EXERCISES.values()],
        "reference": {name: _pair(row) for name, row in REFERENCE.items()},
        "functional": {name: _pair(row) for name, row in FUNCTIONAL.items()},
    }


def _exercise(row: Exercise) -> Json:
    band, need = held_against(REFERENCE, row), held_against(FUNCTIONAL, row)
    return {
        "name": row.name,
        "angle": row.angle,
        "rises": row.rises,
        "goal_deg": row.goal_deg,
        "band": None if band is None else _pair(band),
        "need": None if need is None else need.high if row.rises else need.low,
    }


def _pair(row: Range) -> list[float | None]:
    return [row.low, row.high]
