"""What is to be done next, by subject: kept where every screen sees it, so that none begins without it. Pure.

A plan is an ExerciseBegins that has not begun: exercise and arm, goal, limit, sets, and which set is next.
"""

from dataclasses import dataclass, field

from msgspec.structs import replace

from brachium_viewer.marks import ExerciseBegins

MOST = 32
"""Plans of one subject; more than every exercise with either arm."""

_Key = tuple[str, str]


@dataclass(slots=True)
class Plans:
    """The plans of each subject by exercise and arm, the one meant last at the end."""

    _of: dict[str, dict[_Key, ExerciseBegins]] = field(default_factory=dict)

    def of(self, subject: str | None) -> list[ExerciseBegins]:
        """Return a subject's plans, the one meant last at the end."""
        return list(self._of.get(subject or "", {}).values())

    def mean(self, subject: str, plan: ExerciseBegins) -> None:
        """Take what is chosen to be done next; where the number of its set is known, that one stays."""
        before = self._of.get(subject, {}).get((plan.exercise, plan.side))
        number = plan.set if before is None else before.set
        self._keep(subject, replace(plan, set=number if number <= plan.sets else 1))

    def begun(self, subject: str, begins: ExerciseBegins) -> None:
        """Take a set that began; one that nobody planned, as who trains alone may begin, makes no plan."""
        if (begins.exercise, begins.side) in self._of.get(subject, {}):
            self._keep(subject, begins)

    def ended(self, subject: str, begins: ExerciseBegins) -> None:
        """Take a set that ended: the next one follows, after the last the first again."""
        mine, key = self._of.get(subject, {}), (begins.exercise, begins.side)
        if key in mine:
            mine[key] = replace(mine[key], set=begins.set + 1 if begins.set < mine[key].sets else 1)

    def over(self, subject: str) -> None:
        """Take the end of a session: sets are counted from one again; goals and limits stay."""
        mine = self._of.get(subject, {})
        mine.update({key: replace(plan, set=1) for key, plan in mine.items()})

    def _keep(self, subject: str, plan: ExerciseBegins) -> None:
        mine = self._of.setdefault(subject, {})
        mine.pop((plan.exercise, plan.side), None)
        mine[plan.exercise, plan.side] = plan
        while len(mine) > MOST:
            del mine[next(iter(mine))]
