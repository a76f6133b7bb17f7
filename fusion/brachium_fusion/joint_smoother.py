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
from brachium_fusion.joint_model import (
    NODE_S,
    Floats,
    Interval,
    Joint,
    JointState,
    add,
    begin,
    difference,
    heading_sd,
    in_given_world,
    resume,
    step_of,
)
from brachium_fusion.joint_update import SHARED_HEADING_SD, advance, constrain

SEARCH_S = 120.0
"""The heading at the beginning is found from so much of the recording."""
BLOCK_NODES = 512


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
    """(nodes + 1, 2, 4)."""
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
        self.steps = step_of(gyr[:-1], gyr[1:], 1.0 / rate_hz)
        """(n - 1, 2, 4) from each sample to the next."""
        self.turns = np.empty((self.nodes, self.every + 1, 2, 4))
        """start_from_sample of every interval."""
        self.turns[:, 0] = rotation.IDENTITY
        for i in range(self.every):
            self.turns[:, i + 1] = rotation.multiply(self.turns[:, i], self.steps[self.at[:-1] + i])
        pieces = self.at[:-1, None] + np.arange(self.every + 1)
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
        first = np.array([self.given[0, 0], rotation.multiply(rotation.about(2, start), self.given[0, 1])])
        if learnt is None:
            state = begin(self.joint, first, self.gyr[0], sd)
        else:
            state = resume(self.joint, learnt, first, self.gyr[0], sd)
        # The tilt given at the beginning may be far off, which one linear step back does not mend.
        again = self._smooth(state.copy(), min(BLOCK_NODES, self.nodes)).first
        state.attitude, state.velocity = again.attitude, again.velocity
        found = self._smooth(state, self.nodes)
        self.last = state
        rows, heading = in_given_world(self._all_samples(found.attitude), self.given, self.shared)
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
        given, rate = self.given[at], self.gyr[at]
        gathered = self.intervals.at(slice(count))
        acceleration = centre_acceleration(self.joint, gathered, given[:-1], given[1:], rate[:-1], rate[1:])
        for node in range(count):
            search.take(given[node + 1], rate[node + 1], acceleration[node], self.intervals.span_s)
        if search.is_found():
            return search.best()[0], CERTAIN_SD
        return 0.0, SHARED_HEADING_SD if self.shared else pi

    def _forward(
        self, state: JointState, first: int, end: int
    ) -> Iterator[tuple[Floats, JointState, JointState, float]]:
        """Yield transition, predicted and corrected state and residual at nodes first + 1 to end."""
        for node in range(first, end):
            transition = advance(state, self.intervals.at(node))
            predicted = state.copy()
            shared = None
            if self.shared:
                _, away = in_given_world(state.attitude, self.given[self.at[node + 1]], shared=True)
                shared = float(away)
            residual = constrain(state, self.joint, self.gyr[self.at[node + 1]], shared)
            yield transition, predicted, state.copy(), residual

    def _smooth(self, state: JointState, nodes: int) -> "_Nodes":
        """Return what holds at nodes 0 to `nodes`, of the state at node 0, which becomes the last."""
        begins = list(range(0, nodes, BLOCK_NODES))
        starts = []
        for first in begins:
            starts.append(state.copy())
            for _ in self._forward(state, first, min(first + BLOCK_NODES, nodes)):
                pass
        smoothed = state
        attitude, deviation, residual = np.empty((nodes + 1, 2, 4)), np.empty(nodes + 1), np.zeros(nodes + 1)
        attitude[-1], deviation[-1] = state.attitude, heading_sd(state.covariance)
        for first, start in zip(reversed(begins), reversed(starts), strict=True):
            end = min(first + BLOCK_NODES, nodes)
            block = [(np.eye(1), start, start.copy(), 0.0), *self._forward(start.copy(), first, end)]
            for node in range(end, first - 1, -1):
                if node < end:
                    transition, predicted, _, _ = block[node + 1 - first]
                    _, _, filtered, _ = block[node - first]
                    smoothed = _back(filtered, transition, predicted, smoothed)
                attitude[node], deviation[node] = smoothed.attitude, heading_sd(smoothed.covariance)
                if node > first:
                    residual[node] = block[node - first][3]
        return _Nodes(attitude, deviation, residual, smoothed)


def _back(
    filtered: JointState, transition: Floats, predicted: JointState, smoothed: JointState
) -> JointState:
    """Return the smoothed state before, of the one after (Rauch, Tung, Striebel 1965)."""
    gain = np.linalg.solve(predicted.covariance, transition @ filtered.covariance).T
    state = filtered.copy()
    change = smoothed.covariance - predicted.covariance
    state.covariance = filtered.covariance + gain @ change @ gain.T
    add(state, gain @ difference(smoothed, predicted))
    return state
