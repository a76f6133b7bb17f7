"""Orientation from a whole recording: offline VQF for tilt, a robust fit of the field for heading. Pure.

World is z up; with a magnetometer x east and y magnetic north, without one heading zero is arbitrary.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from vqf import offlineVQF

from brachium_body import rotation
from brachium_fusion.field_model import FieldSteps, field_steps
from brachium_fusion.heading_smoother import fit_heading

Floats = npt.NDArray[np.float64]
Bools = npt.NDArray[np.bool_]

CARRIED_S = 0.5
"""A gap up to this is carried over: straight lines miss less than a fresh start does not know."""
STEP_S = 0.2
"""The field is averaged over this: short against the drift of a heading, long against the noise."""


@dataclass(frozen=True, slots=True, eq=False)
class OfflineOrientation:
    """n samples; rows without gyroscope are NaN, not disturbed."""

    world_from_sensor: Floats
    """(n, 4)"""
    disturbed: Bools
    """(n,) the magnetic field was not the recording's, so heading rests on the gyroscope."""
    gyro_bias: Floats
    """(n, 3) rad/s"""


def smooth_orientation(gyr: Floats, acc: Floats, mag: Floats | None, rate_hz: float) -> OfflineOrientation:
    """Return the orientation at each of n samples on a uniform grid.

    `gyr` rad/s, `acc` m/s^2, `mag` in any unit that is the same throughout, (n, 3) each in sensor axes.
    Rows of NaN in `gyr` or `acc` are gaps: short ones are carried over along straight lines, as live, over
    others tilt and heading are lost. Rows of NaN in `mag` are samples without a magnetometer value. Tilt and
    bias are offline VQF's (Laidig and Seel 2023), forwards and backwards; without any magnetometer value the
    orientation is too.
    """
    n = len(gyr)
    result = OfflineOrientation(np.full((n, 4), np.nan), np.zeros(n, dtype=np.bool_), np.full((n, 3), np.nan))
    measured = np.isfinite(np.concatenate([gyr, acc], axis=1).sum(axis=1))
    carried = measured | _short_gaps(measured, CARRIED_S * rate_hz)
    gyr, acc = (_between(values, measured, carried) for values in (gyr, acc))
    pieces = _pieces(carried)
    for piece in pieces:
        tilted = offlineVQF(
            np.ascontiguousarray(gyr[piece]), np.ascontiguousarray(acc[piece]), None, 1.0 / rate_hz
        )
        result.world_from_sensor[piece] = tilted["quat6D"]
        result.gyro_bias[piece] = tilted["bias"]
    if mag is not None and not np.isnan(mag).all():
        _turn_to_north(result, pieces, gyr, np.where(measured[:, None], mag, np.nan), rate_hz)
    for rows in (result.world_from_sensor, result.gyro_bias):
        rows[~measured] = np.nan
    result.disturbed[~measured] = False
    return result


def _turn_to_north(
    result: OfflineOrientation, pieces: list[slice], gyr: Floats, mag: Floats, rate_hz: float
) -> None:
    """Add the heading offset to every piece, in place."""
    count = max(1, round(STEP_S * rate_hz))
    blocks: list[FieldSteps] = []
    for piece in pieces:
        size = min(count, piece.stop - piece.start)  # a piece shorter than a step is a step of its own
        blocks.append(
            field_steps(
                result.world_from_sensor[piece], gyr[piece] - result.gyro_bias[piece], mag[piece], size
            )
        )
    ends = np.cumsum([len(block.field) for block in blocks])
    spans = [slice(int(end) - len(block.field), int(end)) for end, block in zip(ends, blocks, strict=True)]
    steps = FieldSteps(
        np.concatenate([block.field for block in blocks]),
        np.concatenate([block.response for block in blocks]),
        np.concatenate([block.rate for block in blocks]),
        np.concatenate([block.share for block in blocks]),
    )
    fit = fit_heading(steps, spans, count / rate_hz)
    for piece, span in zip(pieces, spans, strict=True):
        n = piece.stop - piece.start
        middles = (np.arange(span.stop - span.start) + 0.5) * min(count, n) - 0.5
        offset = np.interp(np.arange(n), middles, fit.offset[span])
        result.world_from_sensor[piece] = rotation.multiply(
            rotation.about(2, offset), result.world_from_sensor[piece]
        )
        nearest = np.minimum(np.arange(n) // min(count, n), span.stop - span.start - 1)
        result.disturbed[piece] = fit.disturbed[span][nearest]


def _short_gaps(measured: Bools, longest: float) -> Bools:
    """Return the rows of gaps of up to `longest` samples, without those at the ends."""
    short = np.zeros_like(measured)
    for gap in _pieces(~measured):
        if gap.start > 0 and gap.stop < len(measured) and gap.stop - gap.start <= longest:
            short[gap] = True
    return short


def _between(values: Floats, measured: Bools, wanted: Bools) -> Floats:
    """Return values (n, 3) with straight lines over the wanted rows that were not measured."""
    rows, missing = np.flatnonzero(measured), np.flatnonzero(wanted & ~measured)
    if not len(missing):
        return values
    result = values.copy()
    for axis in range(values.shape[1]):
        result[missing, axis] = np.interp(missing, rows, values[rows, axis])
    return result


def _pieces(measured: Bools) -> list[slice]:
    """Return the runs of samples that were measured."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], measured, [False]]).astype(np.int8)))
    return [slice(int(first), int(end)) for first, end in zip(edges[::2], edges[1::2], strict=True)]
