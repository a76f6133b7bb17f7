"""The calibration of one sensor, step by step, from its samples as they come. Pure."""

from typing import Any, get_args

import msgspec
import numpy as np

from brachium_fusion.sensor_calibration import Refused, SensorFit
from brachium_fusion.sensor_steps import Faces, Motion, Rest
from brachium_fusion.sphere_coverage import text_of
from brachium_fusion.turn_step import Turn
from brachium_wire import calibration_file
from brachium_wire.messages import Info, SensorCalibration
from brachium_wire.samples import Samples
from brachium_wire.sensor_records import SensorProgress, SensorStep

Step = Rest | Faces | Turn
STEPS: dict[SensorStep, type[Step]] = {"rest": Rest, "faces": Faces, "turn": Turn}
ALL: tuple[SensorStep, ...] = get_args(SensorStep)
TRIES = 3
"""A step that is refused so often is given up; what the others find holds."""
LOOK_S = 0.2
DRIFT_DPS = 0.3
"""Between the first rest and the last face: six times what is left of a bias after a good rest."""
LONGEST_S = TRIES * sum(step.longest_s for step in STEPS.values())
"""All steps take no longer, whatever is done."""


def steps_for(asked: list[SensorStep] | None, info: Info) -> list[SensorStep]:
    """Return the steps to do, in order. Raises ValueError for what this sensor cannot do."""
    if info.orientation_only:
        raise ValueError("the sensor gives orientation only: it calibrates itself")
    steps: list[SensorStep] = [step for step in ALL if asked is None or step in asked]
    if not info.magnetometer and "turn" in steps:
        if asked is not None:
            raise ValueError("turn is for magnetometers; this sensor has none")
        steps.remove("turn")
    return steps


class SensorGuide:
    """One sensor's calibration as it runs; `info` describes the sensor as it is when it begins."""

    def __init__(self, segment: str, info: Info, steps: list[SensorStep]) -> None:
        self.segment, self.info, self._steps = segment, info, steps
        self._index, self._attempt = 0, 1
        self._step: Step = STEPS[steps[0]](info.rate_hz)
        self._begun_rows = self._rows = self._looked = 0
        self._fits: dict[SensorStep, SensorFit] = {}
        self._refused: dict[str, str] = {}
        self._words, self._still, self._left_s = self._step.look()[:3]
        self.over = False

    def take(self, samples: Samples) -> bool:
        """Take a batch; return whether there is anything new to tell."""
        if self.over or samples.late or samples.gyr is None or samples.acc is None:
            return False
        self._step.take(Motion(samples.gyr, samples.acc, samples.mag))
        self._rows += len(samples)
        if self._rows - self._looked < LOOK_S * self.info.rate_hz:
            return False
        self._looked = self._rows
        self._look()
        return True

    def _look(self) -> None:
        step, name = self._step, self._steps[self._index]
        try:
            seen = step.look()
            if seen.found is None and self._rows - self._begun_rows > step.longest_s * self.info.rate_hz:
                raise Refused(step.too_late())
        except Refused as reason:
            self._refuse(name, str(reason))
            return
        self._words, self._still, self._left_s = seen.words, seen.still, seen.left_s
        if seen.found is not None:
            self._fits[name] = seen.found
            self._refused.pop(name, None)
            if isinstance(step, Faces):
                self._check_drift(step)
            self._begin(self._index + 1, 1)

    def _check_drift(self, faces: Faces) -> None:
        """The gyroscope rests on every face: warming up shows as a drift since the first rest."""
        rest = self._fits.get("rest")
        if rest is None or faces.last_rates is None:
            return
        drift = float(np.degrees(np.abs(faces.last_rates - np.array(rest.calibration.gyro_bias)).max()))
        rest.scores["gyro_drift_dps"] = drift
        if drift > DRIFT_DPS:
            del self._fits["rest"]
            self._refused["rest"] = (
                f"the gyroscope drifted by {drift:.1f} deg/s between the first rest and the last: let the "
                "sensor warm up for some minutes, then do the rest again"
            )

    def _refuse(self, name: SensorStep, reason: str) -> None:
        self._refused[name] = reason
        if self._attempt < TRIES:
            self._begin(self._index, self._attempt + 1)
        else:
            self._begin(self._index + 1, 1)

    def _begin(self, index: int, attempt: int) -> None:
        if index >= len(self._steps):
            self.over = True
            return
        self._index, self._attempt, self._begun_rows = index, attempt, self._rows
        self._step = STEPS[self._steps[index]](self.info.rate_hz)
        self._words, self._still, self._left_s = self._step.look()[:3]

    def calibration(self) -> SensorCalibration | None:
        """Return the sensor's calibration with what was found in place of what was known; None for nothing.

        Numbers are those of float32: any node can say them again exactly.
        """
        if not self._fits:
            return None
        file = calibration_file.CalibrationFile(node=self.info.node, calibration=self.info.calibration)
        for name, found in self._fits.items():
            fit = calibration_file.Fit(
                part=STEPS[name].part,
                method=found.method,
                date="",
                source="",
                scores=found.scores,
                calibration=found.calibration,
            )
            file = calibration_file.with_fit(file, fit)
        return as_float32(file.calibration)

    def progress(self) -> SensorProgress:
        """Return how far it is."""
        step, name = self._step, self._steps[self._index]
        turn = step if isinstance(step, Turn) else None
        done = self.over and not self._refused
        reason = self._words
        if self.over:
            reason = "; ".join(self._refused.values())
        return SensorProgress(
            segment=self.segment,
            node=self.info.node,
            state="running" if not self.over else "done" if done else "refused",
            step=name,
            steps=self._steps,
            attempt=self._attempt,
            reason=reason,
            still=self._still,
            left_s=round(self._left_s, 1),
            faces=step.seen if isinstance(step, Faces) else [],
            cells=text_of(turn.cells) if turn else "",
            coverage=turn.coverage if turn else 0.0,
            lacks=turn.lacks if turn else "",
            scores={k: v for found in self._fits.values() for k, v in found.scores.items()},
            refused=dict(self._refused),
        )


def as_float32(calibration: SensorCalibration) -> SensorCalibration:
    """Return the calibration with every number rounded to float32."""

    def rounded(value: Any) -> Any:
        return tuple(map(rounded, value)) if isinstance(value, tuple) else float(np.float32(value))

    values = msgspec.structs.asdict(calibration)
    return SensorCalibration(**{name: None if v is None else rounded(v) for name, v in values.items()})
