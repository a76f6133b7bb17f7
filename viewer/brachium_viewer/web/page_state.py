"""What the pages show: bus messages and their times in; frames and state out. Pure: no socket, no clock.

One subject is shown at a time, the same on every screen: the therapist's and the patient's page agree.
"""

from dataclasses import dataclass, field

from brachium_viewer.health import Network
from brachium_viewer.marks import ExerciseBegins
from brachium_viewer.web import frames
from brachium_viewer.web.frames import Json
from brachium_viewer.web.plans import Plans
from brachium_viewer.web.running_set import RunningSet
from brachium_viewer.window import limit_s
from brachium_wire import keys
from brachium_wire.codec import WireError, decode_topic
from brachium_wire.messages import Calibration, Info, Origin, Session, Skeleton

MISSING_NS = round(limit_s("skeleton") * 1e9)
"""An arm whose newest skeleton came longer ago is shown grey and without numbers."""
GONE_NS = 60_000_000_000
"""An arm that was silent for so long is shown no more."""
PROGRESS_NS = 100_000_000
"""The count is told so often; angles are told with every frame."""


@dataclass(slots=True)
class _Arm:
    skeleton: Skeleton
    heard_ns: int


@dataclass(slots=True)
class _Subject:
    arms: dict[str, _Arm] = field(default_factory=dict)
    calibration: Calibration | None = None
    session: Session | None = None
    origins: dict[str, Origin] = field(default_factory=dict)
    """By segment."""


class PageState:
    """All that is known of the room, and what is chosen and running."""

    def __init__(self, room: str, subject: str | None = None, *, own_recorder: str = "") -> None:
        """`own_recorder`: the id of the one whose alarms the session itself knows, and sooner."""
        self.room, self.subject = room, subject
        self._own_recorder = own_recorder
        self.network = Network()
        self.plans = Plans()
        self.running: RunningSet | None = None
        self.stopped: str | None = None
        """Why the patient stopped; until a set begins or somebody else is shown."""
        self._subjects: dict[str, _Subject] = {}
        self._drawn: dict[str, tuple[int, bool]] = {}
        self._progress: tuple[int, Json] | None = None

    def feed(self, key: str, payload: bytes, now_ns: int) -> None:
        """Take one message of the bus; what cannot be read is counted by `network.drops`."""
        try:
            where = keys.parse(key)
        except keys.BadKey:
            where = None
        if where is None or where.topic not in ("skeleton", "calibration", "session"):
            self.network.feed(key, payload, now_ns)
            if where is not None and where.topic == "info":
                self._info(where, payload)
            return
        try:
            message = decode_topic(payload, where.topic)
        except WireError as error:
            drops = self.network.drops
            drops[error.drop.value] = drops.get(error.drop.value, 0) + 1
            return
        subject = self._of(where.subject)
        if isinstance(message, Skeleton):
            subject.arms[where.detail] = _Arm(message, now_ns)
            if self.running is not None and where.subject == self.subject:
                self.running.feed(message)
        elif isinstance(message, Calibration):
            subject.calibration = message
        elif isinstance(message, Session):
            subject.session = message

    def token(self, key: str, alive: bool) -> None:
        """Take a service that came or went; a calibration that was going on ends with its fusion."""
        self.network.token(key, alive)
        if alive or not key.startswith(keys.services(self.room, "fusion/")):
            return
        for one in self._subjects.values():
            if one.calibration is not None and one.calibration.state in ("waiting", "running"):
                one.calibration = None

    def choose(self, subject: str) -> None:
        """Show this subject. Raises BadKey for a name that cannot be one, ValueError while a set runs."""
        keys.subject_chunk(subject)
        if self.running is not None and subject != self.subject:
            raise ValueError(f"a set of {self.subject} is running: stop it first")
        self.subject, self._drawn, self.stopped = subject, {}, None

    def begin(self, begins: ExerciseBegins, from_ns: int) -> None:
        """Count a set from now on. Raises ValueError when one runs or nobody is chosen."""
        if self.subject is None:
            raise ValueError("no subject is chosen")
        if self.running is not None:
            raise ValueError("a set is running: stop it first")
        self.running, self._progress, self.stopped = RunningSet(begins, from_ns), None, None
        self.plans.begun(self.subject, begins)

    def end(self) -> Json | None:
        """Count no more; return where the set stood, or None when none ran."""
        ended, self.running = self.running, None
        if ended is None or self.subject is None:
            return None
        self.plans.ended(self.subject, ended.begins)
        return frames.progress(ended.progress())

    def known(self, subject: str) -> bool:
        """Return whether anything was heard of a subject."""
        return subject in self._subjects

    def instant_ns(self, now_ns: int) -> int:
        """Return a mark's time: now, by the clock of the arm heard last; `now_ns` when none was heard.

        This machine's clock may be minutes off that of the samples, which an arm held up for a moment keeps.
        """
        last = max(self._arms().values(), key=lambda arm: arm.heard_ns, default=None)
        return now_ns if last is None else last.skeleton.time_ns + now_ns - last.heard_ns

    def sides(self) -> list[str]:
        """Return the arms of the subject shown that skeletons come of."""
        return sorted(self._arms(), reverse=True)

    def origin(self) -> Origin:
        """Return where the data of the subject shown come from; anything not worn outweighs what is."""
        subject = self._subjects.get(self.subject or "", _Subject())
        found = {a.skeleton.origin for a in subject.arms.values()} | set(subject.origins.values())
        others: list[Origin] = [origin for origin in ("emulated", "playback") if origin in found]
        return others[0] if others else "worn"

    def frame(self, now_ns: int) -> Json | None:
        """Return the newest of every arm, or None when nothing is new since the last call."""
        drawn = {
            side: (arm.skeleton.time_ns, now_ns - arm.heard_ns > MISSING_NS)
            for side, arm in self._arms().items()
            if now_ns - arm.heard_ns < GONE_NS
        }
        if drawn == self._drawn:
            return None
        self._drawn = drawn
        arms = {
            side: frames.arm(self._arms()[side].skeleton, stale=stale) for side, (_, stale) in drawn.items()
        }
        return {"kind": "frame", "subject": self.subject, "arms": arms, "set": self._counted(now_ns)}

    def state(self, now_ns: int) -> Json:
        """Return everything that changes seldom."""
        report = self.network.report(now_ns)
        shown = [n for n in report.nodes if n.subject == self.subject]
        subject = self._subjects.get(self.subject or "", _Subject())
        running = self.running
        return {
            "kind": "state",
            "subjects": self._choices(),
            "subject": self.subject,
            "origin": self.origin(),
            "live": sum(n.state == "live" for n in shown),
            "sensors": [frames.sensor(n) for n in shown],
            "waiting": report.waiting,
            "services": {s.kind: s.up for s in sorted(report.services, key=lambda s: s.up)},
            "alarms": [
                {"what": "recording", "reason": s.alarm}
                for s in report.services
                if s.kind == "recorder" and s.alarm and s.id != self._own_recorder
            ],
            "sides": self.sides(),
            "calibration": frames.calibration(subject.calibration),
            "session": frames.session(subject.session),
            "stopped": self.stopped,
            "plans": [frames.plan(one) for one in self.plans.of(self.subject)],
            "set": None if running is None else frames.running(running.begins, running.from_ns),
        }

    def _counted(self, now_ns: int) -> Json | None:
        if self.running is None:
            return None
        if self._progress is None or now_ns - self._progress[0] >= PROGRESS_NS:
            self._progress = now_ns, frames.progress(self.running.progress())
        return self._progress[1]

    def _choices(self) -> list[Json]:
        return [
            {"name": name, "sides": sorted(one.arms, reverse=True), "sensors": len(one.origins)}
            for name, one in sorted(self._subjects.items())
        ]

    def _arms(self) -> dict[str, _Arm]:
        return self._subjects[self.subject].arms if self.subject in self._subjects else {}

    def _info(self, where: keys.Key, payload: bytes) -> None:
        try:
            message = decode_topic(payload, "info")
        except WireError:
            return  # counted by the network's health
        if isinstance(message, Info):
            self._of(where.subject).origins[where.detail] = message.origin

    def _of(self, name: str) -> _Subject:
        """Return a subject's record; the first that is heard of is shown."""
        if self.subject is None and not name.endswith(keys.REFERENCE):
            self.subject = name
        return self._subjects.setdefault(name, _Subject())
