"""An emulated optical tracker: markers at 200 Hz, brought down to the sensors' rate (Zhou 2008, 2.3.2)."""

from dataclasses import dataclass
from math import sqrt

import numpy as np
import numpy.typing as npt
from scipy import signal

from brachium.evaluation.emulated import Emulated
from brachium_body.angles import INDEX
from brachium_nodes.wearer import Wearer

Floats = npt.NDArray[np.float64]

RATE_HZ = 200.0
MARKER_M = 0.0003
"""Standard deviation of a marker's place per axis: active markers at some metres; an assumption."""
WAND_M = 0.05
"""Length of the wand whose two markers show how the forearm is turned."""


@dataclass(frozen=True, slots=True, eq=False)
class Tracked:
    """What the tracker saw, on the sensors' grid."""

    places: dict[str, Floats]
    """shoulder, elbow, wrist in trunk axes from the chest, (n, 3) m."""
    elbow_flexion: Floats
    """(n,) rad, from the three places: 0 when they lie in a line."""
    forearm_pronation: Floats
    """(n,) rad, from the forearm's wand."""


def track(made: Emulated) -> Tracked:
    """Return what the tracker saw of one trial; the markers' noise is drawn from its seed."""
    trial, n = made.trial, len(made.session.time_s)
    down = round(RATE_HZ / trial.rate_hz)
    truth = Wearer(trial.settings()).truth(np.arange(n * down) / RATE_HZ, trial.side)
    random = np.random.default_rng([trial.seed, round(RATE_HZ)])

    def seen(true: Floats, sd: float) -> Floats:
        noisy = true + sd * random.standard_normal(true.shape)
        # The filter is symmetric and delays nothing; at its edges the person stands still.
        return np.asarray(signal.resample_poly(noisy, 1, down, axis=0, padtype="line"))[:n]

    places = {name: seen(truth.positions[name], MARKER_M) for name in ("shoulder", "elbow", "wrist")}
    upper, fore = places["elbow"] - places["shoulder"], places["wrist"] - places["elbow"]
    cosine = (upper * fore).sum(axis=1) / np.linalg.norm(upper, axis=1) / np.linalg.norm(fore, axis=1)
    turn = np.unwrap(truth.angles[:, INDEX["forearm_pronation"]])
    return Tracked(
        places,
        np.arccos(np.clip(cosine, -1.0, 1.0)),
        seen(turn, sqrt(2.0) * MARKER_M / WAND_M),
    )
