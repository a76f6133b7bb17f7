"""The orientation of two sensors to each other by the joint between them, from a whole recording. Pure.

The filter's model forward, then Rauch, Tung and Striebel's recursion backward on the same manifold. Blocks
of the forward pass are computed again as the backward pass reaches them, so memory does not grow with time.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from math import inf, pi

import numpy as np

from brachium_body import rotation
from brachium_fusion.joint_heading import CERTAIN_SD, HeadingSearch, centre_acceleration
from brachium_fusion.joint_matrices import Floats, matrix_of
from brachium_fusion.joint_model import (
    NODE_S,
    Interval,
    Joint,
    JointState,
    add,
    begin,
    difference,
    heading_sd,
    in_given_world,
    resume,
)
from brachium_fusion.joint_update import SHARED_HEADING_SD, advance, constrain

SEARCH_S = 120.0
"""The heading at the beginning is found from so much of the recording."""
START_NODES = 256
"""Of which, smoothed once, the tilt at the beginning is taken."""
BLOCK_NODES = 2048
"""Of which 45 MB are kept."""


@dataclass(frozen=True, slots=True, eq=False)
class JointTrajectory:
    """Both sensors in one world, one row a sample; NaN where the samples are missing."""

    world_from_a: Floats
    """(n, 4), headings as given."""
    world_from_b: Floats
    """(n, 4), headings those of the same world."""
    heading_rad: Floats
    """(n,) by how much b's given orientation had to be turned about the vertical, from the left."""
    heading_sd_rad: Floats
    """(n,) standard deviation of the heading between a and b; pi where nothing is known."""
    residual: Floats
    """(n,) how far the joint centre's two velocities were apart, in standard deviations; 1 is as expected."""


def smooth_joint(
    joint: Joint,
    rate_hz: float,
    a: tuple[Floats, Floats],
    b: tuple[Floats, Floats],
    world_from_a: Floats,
    world_from_b: Floats,
    shared_heading: bool = False,
    start_sd_rad: float | None = None,
) -> JointTrajectory:
    """Return both sensors' orientations in one world.

    `a`, `b`: gyr (n, 3) rad/s and acc (n, 3) m/s^2 of each sensor on one grid of `rate_hz`; world_from_a and
    world_from_b (n, 4) by each sensor's own filter. Rows with NaN in any are missing. `shared_heading`: both
    orientations come with a magnetometer's heading, which then is weak evidence. `start_sd_rad`: both begin
    in one world, for instance by a pose, to this standard deviation.
    """
    gyr, acc = np.stack([a[0], b[0]], axis=1), np.stack([a[1], b[1]], axis=1)
    given = np.stack([world_from_a, world_from_b], axis=1)
    n = len(gyr)
    attitude = np.full((n, 2, 4), np.nan)
    heading, sd, residual = np.full(n, np.nan), np.full(n, pi), np.full(n, np.nan)
    whole = np.isfinite(np.concatenate([gyr, acc, given], axis=2)).all(axis=(1, 2))
    edges = np.flatnonzero(np.diff(np.concatenate([[False], whole, [False]]).astype(int)))
    learnt: JointState | None = None
    for first, end in edges.reshape(-1, 2).tolist():
        part = _Part(joint, rate_hz, gyr[first:end], acc[first:end], given[first:end], shared_heading)
        rows = slice(first, end)
        found = part.solve(learnt, start_sd_rad if first == 0 else None)
        attitude[rows], heading[rows], sd[rows], residual[rows] = found
        learnt = part.last or learnt
    return JointTrajectory(attitude[:, 0], attitude[:, 1], heading, sd, residual)


@dataclass(frozen=True, slots=True, eq=False)
class _Nodes:
    """What was found at the nodes of a part."""

    attitude: Floats
    """(nodes + 1, 2, 3, 3)."""
    heading_sd: Floats
    residual: Floats
    first: JointState
    """Smoothed, at the first node."""


class _Part:
    """A stretch without gaps."""

    def __init__(
        self, joint: Joint, rate_hz: float, gyr: Floats, acc: Floats, given: Floats, shared: bool
    ) -> None:
        self.joint, self.gyr, self.given, self.shared = joint, gyr, given, shared
        self.last: JointState | None = None
        """The state at the end, once solved."""
        self.every = max(1, round(NODE_S * rate_hz))
        self.nodes = (len(gyr) - 1) // self.every
        self.at = np.arange(self.nodes + 1) * self.every
        self.steps = rotation.from_rotation_vector((0.5 / rate_hz) * (gyr[:-1] + gyr[1:]))
        """(n - 1, 2, 4) from each sample to the next."""
        self.turns = np.empty((self.nodes, self.every + 1, 2, 4))
        """start_from_sample of every interval."""
        self.turns[:, 0] = rotation.IDENTITY
        for i in range(self.every):
            self.turns[:, i + 1] = rotation.multiply(self.turns[:, i], self.steps[self.at[:-1] + i])
        pieces = self.at[:-1, None] + np.arange(self.every + 1)
        self.matrices = matrix_of(given[self.at])
        """World_from_sensor (nodes + 1, 2, 3, 3) as given."""
        self.intervals = Interval.gather(self.turns, gyr[pieces], acc[pieces], 1.0 / rate_hz)

    def solve(
        self, learnt: JointState | None, start_sd: float | None
    ) -> tuple[Floats, Floats, Floats, Floats]:
        """Return attitudes (n, 2, 4), heading (n,), its standard deviation and residual (n,); `learnt` gives
        biases and lever arms of a part before, `start_sd` says that both begin in one world."""
        start, sd = self._search() if start_sd is None else (0.0, start_sd)
        if not (self.joint.has_axes or self.joint.has_levers):
            sd = SHARED_HEADING_SD if self.shared else pi
            n = len(self.gyr)
            return self.given, np.zeros(n), np.full(n, sd), np.full(n, np.nan)
        first = matrix_of(self.given[0])
        first[1] = matrix_of(rotation.about(2, start)) @ first[1]
        if learnt is None:
            state = begin(self.joint, first, self.gyr[0], sd)
        else:
            state = resume(self.joint, learnt, first, self.gyr[0], sd)
        # The tilt given at the beginning may be far off, which one linear step back does not mend.
        again = self._smooth(state.copy(), min(START_NODES, self.nodes)).first
        state.attitude = again.attitude
        state.others = np.concatenate([again.velocity, state.others[:, 3:]], axis=1)
        found = self._smooth(state, self.nodes)
        self.last = state
        rows = self._all_samples(rotation.from_matrix(found.attitude))
        common, heading = in_given_world(matrix_of(rows), matrix_of(self.given), self.shared)
        rows = rotation.multiply(rotation.about(2, common)[:, None], rows)
        node = np.minimum(np.arange(len(self.gyr)) // self.every, self.nodes)
        return rows, heading, found.heading_sd[node], found.residual[node]

    def _all_samples(self, attitude: Floats) -> Floats:
        """Fill the samples between nodes by the gyroscopes; what lacks at the next node is spread evenly."""
        whole = rotation.multiply(attitude[:-1], self.turns[:, -1])
        lacking = rotation.to_rotation_vector(rotation.multiply(attitude[1:], rotation.inverse(whole)))
        rows = np.empty((len(self.gyr), 2, 4))
        rows[self.at] = attitude
        for i in range(1, self.every):
            part = rotation.from_rotation_vector(lacking * (i / self.every))
            turned = rotation.multiply(attitude[:-1], self.turns[:, i])
            rows[self.at[:-1] + i] = rotation.multiply(part, turned)
        for i in range(int(self.at[-1]) + 1, len(rows)):
            rows[i] = rotation.multiply(rows[i - 1], self.steps[i - 1])
        return rows

    def _search(self) -> tuple[float, float]:
        """Return b's heading at the beginning and its standard deviation."""
        search = HeadingSearch(self.joint, forget_s=inf)
        count = min(self.nodes, round(SEARCH_S / NODE_S))
        at = self.at[: count + 1]
        given, rate = self.matrices[: count + 1], self.gyr[at]
        gathered = self.intervals.at(slice(count))
        acceleration = centre_acceleration(self.joint, gathered, given[:-1], given[1:], rate[:-1], rate[1:])
        for node in range(count):
            search.take(given[node + 1], rate[node + 1], acceleration[node], self.intervals.span_s)
        if search.is_found():
            return search.best()[0], CERTAIN_SD
        return 0.0, SHARED_HEADING_SD if self.shared else pi

    def _forward(self, state: JointState, first: int, end: int) -> Iterator["_Step"]:
        """Yield what happens at nodes first + 1 to end; carries the state there in place."""
        for node in range(first, end):
            before = state.copy()
            transition = advance(state, self.intervals.at(node))
            predicted = state.copy()
            shared = None
            if self.shared:
                _, away = in_given_world(state.attitude, self.matrices[node + 1], shared=True)
                shared = float(away)
            residual = constrain(state, self.joint, self.gyr[self.at[node + 1]], shared)
            yield _Step(before, transition, predicted, residual)

    def _smooth(self, state: JointState, nodes: int) -> "_Nodes":
        """Return what holds at nodes 0 to `nodes`, of the state at node 0, which becomes the last."""
        blocks = [(first, min(first + BLOCK_NODES, nodes)) for first in range(0, nodes, BLOCK_NODES)]
        starts, steps = [], list[_Step]()
        for first, end in blocks:
            starts.append(state.copy())
            steps = []
            for step in self._forward(state, first, end):
                if end == nodes:  # the way back begins here
                    steps.append(step)
        smoothed = state
        attitude, deviation, residual = (
            np.empty((nodes + 1, 2, 3, 3)),
            np.empty(nodes + 1),
            np.zeros(nodes + 1),
        )
        attitude[-1], deviation[-1] = state.attitude, heading_sd(state.covariance)
        for (first, end), start in zip(reversed(blocks), reversed(starts), strict=True):
            if end < nodes:
                steps = list(self._forward(start, first, end))
            for node in range(end - 1, first - 1, -1):
                step = steps[node - first]
                smoothed = _back(step, smoothed)
                attitude[node], deviation[node] = smoothed.attitude, heading_sd(smoothed.covariance)
                residual[node + 1] = step.residual
        return _Nodes(attitude, deviation, residual, smoothed)


@dataclass(frozen=True, slots=True, eq=False)
class _Step:
    """From one node to the next, forward."""

    before: JointState
    transition: Floats
    predicted: JointState
    """Before the constraints of the next node."""
    residual: float


def _back(step: _Step, smoothed: JointState) -> JointState:
    """Return the smoothed state before, of the one after (Rauch, Tung, Striebel 1965)."""
    covariance, predicted = step.before.covariance, step.predicted
    gain = np.linalg.solve(predicted.covariance, step.transition @ covariance).T
    state = step.before.copy()
    state.covariance = covariance + gain @ (smoothed.covariance - predicted.covariance) @ gain.T
    add(state, gain @ difference(smoothed, predicted))
    return state
