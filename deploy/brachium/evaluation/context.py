"""What one run of `brachium evaluate` is asked for, and what its tables share."""

import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from brachium.evaluation.emulated import Emulated
from brachium.evaluation.tables import middle
from brachium.evaluation.trials import Trial
from brachium_nodes.sensors import Level

SEEDS = (1, 2, 3)
"""Of the emulated wearers, where none are given: figures are the median over them."""
DEFAULT_LEVELS: tuple[Level, ...] = ("ideal", "typical")


@dataclass
class Context:
    """Levels, seeds and recordings, and every emulated trial that was made so far."""

    levels: tuple[Level, ...] = DEFAULT_LEVELS
    seeds: tuple[int, ...] = SEEDS
    data: Path | None = None
    """The folder of real recordings."""
    quick: bool = False
    """Shorter: a look, not a figure."""
    progress: Callable[[str], None] = lambda text: print(text, file=sys.stderr, flush=True)
    _trials: dict[Trial, Emulated] = field(default_factory=dict)

    def emulated(self, trial: Trial) -> Emulated:
        """Return a trial; what it holds is made once in a run."""
        if trial not in self._trials:
            self._trials[trial] = Emulated(trial)
        return self._trials[trial]

    def over_seeds(self, figure: Callable[[int], float | None]) -> float | None:
        """Return the median of a figure over the seeds."""
        return middle([figure(seed) for seed in self.seeds])

    def over_seeds_each(self, figures: Callable[[int], Sequence[float | None]]) -> list[float | None]:
        """Return the median of each of several figures over the seeds."""
        return [middle(values) for values in zip(*(figures(seed) for seed in self.seeds), strict=True)]
