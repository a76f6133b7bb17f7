"""The heading that a filter without magnetometer lacks, from a whole recording's magnetic field. Pure.

Maximum a posteriori by Gauss-Newton: one heading offset a step that wanders as the gyroscope lets it, one
field, one calibration (field_model). Residuals are taken as Student's t by reweighting, so a magnet passed by
counts little and the field that most of the recording agrees upon is the reference. The offsets couple only
to their neighbours, so the normal equations are a tridiagonal band with a narrow border: time grows with the
length.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.linalg import solveh_banded
from scipy.ndimage import uniform_filter1d

from brachium_fusion.field_model import (
    CALIBRATION,
    HARD_IRON,
    LAG_SD_S,
    SOFT_IRON,
    FieldSteps,
    heading_variance,
    looks,
)

Floats = npt.NDArray[np.float64]
Bools = npt.NDArray[np.bool_]

HARD_IRON_SD = 0.02
"""Of the field's strength: a calibration leaves 1 uT."""
MAGNET_SD = 0.3
"""Of the field's strength: what a magnet on the sensor does."""
MAGNET_HINT = 0.03
"""Hard iron above this is reason to allow for a magnet,"""
MAGNET = 0.08
"""and above this it is one,"""
MAGNET_SURE = 5.0
"""when it is so many times its standard deviation,"""
MAGNET_FITS = 0.8
"""and residuals have this weight on average (where all is well, above 1)."""
SOFT_IRON_SD = 0.02
"""Also for deviations that go with the place, and so with the attitude."""
FIELD_SD = 0.015
"""Of the field's strength: how it varies between places of an undisturbed room."""
APART_S = 2.0
"""Deviations of the field keep together for about this long in movement."""
FREEDOM = 4.0
"""Degrees of freedom of Student's t."""
DISTURBED = 0.1
"""Of the field's strength: a residual above this over DISTURBED_S is a disturbance."""
DISTURBED_S = 2.0
START_S = 30.0
"""The first guess of the offset is the direction of the mean horizontal field over this."""
MOST_STEPS = 15
CONVERGED_RAD = 1e-4
BREAK_VARIANCE = 10.0
"""rad^2 of heading that a gap leaves open: nothing is known."""


@dataclass(frozen=True, slots=True, eq=False)
class HeadingFit:
    """The result for k steps."""

    offset: Floats
    """(k,) rad, world_from_sensor = Rz(offset) levelled; continuous, not wrapped, within a piece."""
    calibration: Floats
    """(CALIBRATION,) lag in s, hard iron in the unit of the field, soft iron as parts of one."""
    horizontal: float
    vertical: float
    residual: Floats
    """(k, 3) in the unit of the field."""
    disturbed: Bools
    """(k,)"""


def fit_heading(steps: FieldSteps, pieces: list[slice], step_s: float) -> HeadingFit:
    """Fit a recording of `pieces`, between which the heading is lost, in steps of `step_s`.

    At least one step has a magnetometer value.
    """
    strength = float(np.median(np.linalg.norm(steps.field[steps.share > 0.0], axis=1)))
    fit, _, _ = _fit(steps, pieces, step_s, strength, HARD_IRON_SD)
    if np.linalg.norm(fit.calibration[HARD_IRON]) > MAGNET_HINT * strength:
        other, covariance, fits = _fit(steps, pieces, step_s, strength, MAGNET_SD)
        size = float(np.linalg.norm(other.calibration[HARD_IRON]))
        sd = float(np.sqrt(np.linalg.eigvalsh(covariance[HARD_IRON, HARD_IRON])[-1]))
        if size > max(MAGNET * strength, MAGNET_SURE * sd) and fits > MAGNET_FITS:
            return other
    return fit


def _fit(
    steps: FieldSteps, pieces: list[slice], step_s: float, strength: float, hard_iron_sd: float
) -> tuple[HeadingFit, Floats, float]:
    """Return the fit, the calibration's covariance, and the mean weight of the residuals."""
    k = len(steps.field)
    noise = FIELD_SD * strength
    sure = looks(steps.rate, step_s, APART_S) * steps.share
    drift = heading_variance(steps.rate, step_s)
    drift = 0.5 * (drift[1:] + drift[:-1])
    for piece in pieces[1:]:
        drift[piece.start - 1] = BREAK_VARIANCE
    sd = np.empty(CALIBRATION)
    sd[0], sd[HARD_IRON], sd[SOFT_IRON] = LAG_SD_S, hard_iron_sd * strength, SOFT_IRON_SD
    prior = np.concatenate([np.zeros(2), 1.0 / sd**2])
    shared = np.zeros(2 + CALIBRATION)
    shared[:2] = _median_field(steps)
    offset = _first_offset(steps, pieces, step_s)
    jacobian = np.zeros((k, 3, 2 + CALIBRATION))
    jacobian[:, 2, 1] = 1.0
    jacobian[:, :, 2:] = steps.response
    weight = sure / noise**2  # for the first change; then by the residuals
    trusted, information = np.ones(k), np.diag(prior)
    residual = _residual(steps, offset, shared)
    squared = np.einsum("ki,ki->k", residual, residual)
    for _ in range(MOST_STEPS):
        sine, cosine = np.sin(offset), np.cos(offset)
        jacobian[:, 0, 0], jacobian[:, 1, 0] = sine, cosine
        change, shared_change, information = _solve(
            offset, shared, residual, weight, drift, prior, jacobian, shared[0] * np.stack([cosine, -sine], 1)
        )
        offset = offset + change
        shared = shared + shared_change
        residual = _residual(steps, offset, shared)
        squared = np.einsum("ki,ki->k", residual, residual)
        trusted = (FREEDOM + 3.0) / (FREEDOM + squared / noise**2)
        weight = sure / noise**2 * trusted
        if np.abs(change).max() < CONVERGED_RAD:
            break
    steps_wide = max(1, round(DISTURBED_S / step_s))
    share = np.maximum(uniform_filter1d(steps.share, steps_wide), 1e-9)
    level = uniform_filter1d(squared * steps.share, steps_wide) / share
    fit = HeadingFit(
        offset,
        shared[2:],
        float(shared[0]),
        float(shared[1]),
        residual,
        level > (DISTURBED * strength) ** 2,
    )
    covariance = np.linalg.inv(information)[2:, 2:].astype(np.float64)
    return fit, covariance, float(sure @ trusted / sure.sum())


def _solve(
    offset: Floats,
    shared: Floats,
    residual: Floats,
    weight: Floats,
    drift: Floats,
    prior: Floats,
    jacobian: Floats,
    turned: Floats,
) -> tuple[Floats, Floats, Floats]:
    """Return the Gauss-Newton change of the offsets and of what all steps share, and the latter's
    information."""
    k, _, border = jacobian.shape
    weighted = jacobian * weight[:, None, None]
    band = np.zeros((2, k))
    band[1] = weight * np.einsum("ki,ki->k", turned, turned)
    band[1, 1:] += 1.0 / drift
    band[1, :-1] += 1.0 / drift
    band[0, 1:] = -1.0 / drift
    right = np.empty((k, 1 + border))
    right[:, 0] = weight * np.einsum("ki,ki->k", turned, residual[:, :2])
    pull = np.diff(offset) / drift
    right[1:, 0] -= pull
    right[:-1, 0] += pull
    right[:, 1:] = np.einsum("ki,kig->kg", turned, weighted[:, :2])
    flat, flat_weighted = jacobian.reshape(-1, border), weighted.reshape(-1, border)
    corner = flat.T @ flat_weighted + np.diag(prior)
    corner_right = flat_weighted.T @ residual.ravel() - prior * shared
    solved = solveh_banded(band, right, check_finite=False)
    coupled = right[:, 1:].T @ solved
    information: Floats = corner - coupled[:, 1:]
    shared_change = np.linalg.solve(information, corner_right - coupled[:, 0]).astype(np.float64)
    change: Floats = solved[:, 0] - solved[:, 1:] @ shared_change
    return change, shared_change, information


def _residual(steps: FieldSteps, offset: Floats, shared: Floats) -> Floats:
    expected = steps.response @ shared[2:]
    expected[:, 0] += shared[0] * np.sin(offset)
    expected[:, 1] += shared[0] * np.cos(offset)
    expected[:, 2] += shared[1]
    return np.where(steps.share[:, None] > 0.0, steps.field - expected, 0.0)


def _median_field(steps: FieldSteps) -> tuple[float, float]:
    field = steps.field[steps.share > 0.0]
    return float(np.median(np.hypot(field[:, 0], field[:, 1]))), float(np.median(field[:, 2]))


def _first_offset(steps: FieldSteps, pieces: list[slice], step_s: float) -> Floats:
    """Return (k,) the heading of the mean field around each step: near enough for Gauss-Newton to go on."""
    offset = np.zeros(len(steps.field))
    wide = max(1, round(START_S / step_s))
    for piece in pieces:
        mean = uniform_filter1d(steps.field[piece, :2] * steps.share[piece, None], wide, axis=0)
        offset[piece] = np.unwrap(np.arctan2(mean[:, 0], mean[:, 1]))
    return offset
