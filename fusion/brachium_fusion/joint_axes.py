"""The two axes of a joint, and the heading between the sensors beside it, from movement. Pure.

A joint of two axes (elbow: flexion, then pronation) leaves its trace in the orientations of the sensors
beside it, whatever the shoulder does meanwhile and whoever moves the arm. With axis j1 fixed in sensor a, j2
fixed in sensor b, and b's world turned into a's by the heading d,

    a1 = R_a j1,  a2 = Z(d) R_b j2
    (Z(d) w_b - w_a) . (a1 x a2) = 0     the joint does not turn about the line across both axes
    a1 . a2 = sin(carrying)              the angle between the axes stays what it is
    d(t)                                 wanders slowly: without magnetometers each has its own heading

All are solved together by weighted least squares with a robust loss, for several starts. The unknowns are
those of Laidig, Weygers and Seel 2022 (Sensors 22:9850); weights and solver are this project's. j1 and j2 are
lines: their signs are not seen, and j1 with carrying fits as well as -j1 with -carrying.
"""

from dataclasses import dataclass
from math import radians

import numpy as np
import numpy.typing as npt

from brachium_body import rotation
from brachium_fusion.joint_equations import LEAST_SINE, AxisPriors, Guess, JointEquations
from brachium_fusion.joint_motion import JointMotion

Floats = npt.NDArray[np.float64]

FEWEST_ROWS = 20
STARTS = 6
STEPS = 40
REFINED = 3
"""Times the noise is taken anew from the residuals, so that priors weigh as they should."""
LOOK_ROWS = 120
"""Instants used to choose the starts."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class JointAxes:
    """What movement shows of a joint. Standard deviations are rad, from the covariance and the residuals."""

    axis_a: Floats
    """(3,) unit, in sensor a."""
    axis_b: Floats
    """(3,) unit, in sensor b."""
    carrying: float
    """asin(a1 . a2), rad; its sign goes with those of the axes."""
    knots_s: Floats
    headings: Floats
    """(k,) rad at the knots, straight between them."""
    axis_a_sd: float
    axis_b_sd: float
    carrying_sd: float
    heading_sd: float
    """At the knot where it is known best."""
    residual: float
    """Rms of the rate that the axes do not explain over the rms of the joint's rate."""
    cost: float
    """Sum of squares in standard deviations, priors included: a difference of 4 is two of them."""

    def heading_at(self, time_s: npt.ArrayLike) -> Floats:
        """Return the heading (...) rad at times (...) s; beyond the knots it stays."""
        return np.asarray(np.interp(np.asarray(time_s), self.knots_s, self.headings), dtype=np.float64)


def fit_joint_axes(motion: JointMotion, priors: AxisPriors) -> list[JointAxes]:
    """Return the axes, heading and carrying angle that fit the movement, the best fit first.

    More than one where minima are apart: who knows more than movement shows may choose among them by cost.
    What movement does not show keeps its prior, and a large standard deviation says so. Raises ValueError
    for fewer than 20 instants.
    """
    if len(motion.time_s) < FEWEST_ROWS:
        raise ValueError(
            f"expected at least {FEWEST_ROWS} instants of both sensors, got {len(motion.time_s)}"
        )
    equations = JointEquations(motion, priors)
    found = _distinct([_descend(equations, start) for start in _starts(equations)])
    for _ in range(REFINED):
        equations = JointEquations(motion, priors, equations.noise(found[0][1]))
        found = _distinct([_descend(equations, guess) for _, guess in found])
    return [_result(equations, cost, guess) for cost, guess in found]


def _distinct(found: list[tuple[float, Guess]]) -> list[tuple[float, Guess]]:
    """Return solutions in order of cost without those that an earlier one repeats."""
    kept: list[tuple[float, Guess]] = []
    for cost, guess in sorted(found, key=lambda item: item[0]):
        if not any(_alike(guess, other) for _, other in kept):
            kept.append((cost, guess))
    return kept


def _result(equations: JointEquations, cost: float, guess: Guess) -> JointAxes:
    sd = np.sqrt(_variances(equations, guess))
    return JointAxes(
        axis_a=guess.axis_a,
        axis_b=guess.axis_b,
        carrying=guess.carrying,
        knots_s=equations.knots_s,
        headings=guess.headings,
        axis_a_sd=float(np.hypot(sd[0], sd[1])),
        axis_b_sd=float(np.hypot(sd[2], sd[3])),
        carrying_sd=float(sd[4]),
        heading_sd=float(sd[5:].min()),
        residual=equations.unexplained(guess),
        cost=cost,
    )


def _descend(equations: JointEquations, guess: Guess) -> tuple[float, Guess]:
    """Return the cost and the guess where Levenberg-Marquardt steps from `guess` end."""
    damping, cost = 1e-3, equations.cost(guess)
    for _ in range(STEPS):
        residuals, jacobian = equations.linear(guess)
        weight = equations.weights(residuals)
        normal = jacobian.T @ (weight[:, None] * jacobian)
        gradient = jacobian.T @ (weight * residuals)
        while damping < 1e6:
            step = np.linalg.solve(normal + damping * np.diag(np.diag(normal)), -gradient).astype(np.float64)
            trial = guess.moved(step)
            trial_cost = equations.cost(trial)
            if trial_cost < cost:
                break
            damping *= 10.0
        else:
            break
        done = cost - trial_cost < 1e-7 * cost
        guess, cost, damping = trial, trial_cost, max(1e-9, 0.1 * damping)
        if done:
            break
    return cost, guess


def _variances(equations: JointEquations, guess: Guess) -> Floats:
    residuals, jacobian = equations.linear(guess)
    information = jacobian.T @ (equations.weights(residuals)[:, None] * jacobian)
    information += np.eye(len(information)) / np.pi**2  # no angle is less known than half a turn
    return np.array(np.diag(np.linalg.inv(information)), dtype=np.float64)


def _starts(equations: JointEquations) -> list[Guess]:
    """Return the most promising of many guesses, no two alike, the best first."""
    motion, priors = equations.motion, equations.priors
    every = max(1, len(motion.time_s) // LOOK_ROWS)
    axes_a = _cone(priors.axis_a, priors.across_a)
    axes_b = _cone(priors.axis_b, None)
    headings = np.arange(-np.pi, np.pi, np.pi / 6.0)
    if priors.heading is not None:
        middle, sd = priors.heading.at(equations.knots_s[:1])
        headings = middle + np.minimum(sd, 0.6) * np.array([-1.5, -0.7, 0.0, 0.7, 1.5])
    a1 = np.einsum("nij,aj->ani", motion.world_from_a[::every], axes_a)
    a2 = np.einsum("nij,bj->bni", motion.world_from_b[::every], axes_b)
    weight = equations.rate_weight[::every]
    costs = np.empty((len(headings), len(axes_a), len(axes_b)))
    for i, heading in enumerate(headings):
        turn = rotation.to_matrix(rotation.about(2, heading))
        second, rate = a2 @ turn.T, motion.rate_b[::every] @ turn.T - motion.rate_a[::every]
        # rate . (a1 x a2) = (rate x a1) . a2
        cosine = np.einsum("ani,bni->abn", a1, second)
        first = np.einsum("ani,bni->abn", np.cross(rate, a1), second) * weight
        first /= np.sqrt(np.maximum(1.0 - cosine**2, LEAST_SINE**2))
        angle = cosine / equations.angle_sd
        costs[i] = equations.loss(first).sum(axis=-1) + equations.loss(angle).sum(axis=-1)
    starts: list[Guess] = []
    for index in np.argsort(costs, axis=None):
        i, a, b = np.unravel_index(index, costs.shape)
        guess = Guess(axes_a[a], axes_b[b], 0.0, np.full(len(equations.knots_s), headings[i]))
        if not any(_alike(guess, start) for start in starts):
            starts.append(guess)
        if len(starts) == STARTS:
            break
    return starts


def _alike(one: Guess, other: Guess) -> bool:
    """Return whether two guesses have the same lines and nearly one heading."""
    near = float(np.abs(rotation.wrap(one.headings[0] - other.headings[0]))) < 0.7
    far = np.cos(radians(25.0))
    return bool(near and abs(one.axis_a @ other.axis_a) > far and abs(one.axis_b @ other.axis_b) > far)


def _cone(axis: Floats | None, across: Floats | None) -> Floats:
    """Return candidate axes (m, 3): near `axis`, else across `across`, else all over the half sphere."""
    if axis is not None:
        return axis[None]
    if across is not None:
        first, second = np.linalg.svd(across[None])[2][1:]
        angle = np.arange(0.0, np.pi, np.pi / 12.0)[:, None]
        return np.asarray(np.cos(angle) * first + np.sin(angle) * second, dtype=np.float64)
    number = np.arange(40) + 0.5  # a spiral of equal areas
    height, turn = number / 40.0, number * np.pi * (3.0 - np.sqrt(5.0))
    flat = np.sqrt(1.0 - height**2)
    return np.stack([flat * np.cos(turn), flat * np.sin(turn), height], axis=-1).astype(np.float64)
