"""What the live view knows at a moment, and what it therefore draws: messages and times in, drawings out."""

from collections.abc import Iterator
from dataclasses import dataclass, field

from brachium_body.segments import SEGMENTS
from brachium_viewer import panel
from brachium_viewer.drawings import Arm, Drawing, Label, Layout, Range, Text
from brachium_viewer.raw_signals import RawSignals
from brachium_viewer.scene import (
    ARM_COLOUR,
    CHEST_HEIGHT,
    PLOTS,
    draw_body,
    draw_silence,
    draw_skeleton,
    hand_in_picture,
    lean,
    line_colours,
    place_of,
)
from brachium_viewer.trails import HandTrail
from brachium_wire.messages import Calibration, Message, SampleBatch, Skeleton, Status
from brachium_wire.samples import read_samples
from brachium_wire.topics import TOPICS

SILENT_S = TOPICS["skeleton"].stale_after_s or 0.5
SETTLE_S = 1.0
"""Panels are arranged anew this long after the last arm or angle came, so that they do not jump."""
SLOW_S = 1.0
"""Words and reference lines are drawn this often."""
MAX_SUBJECTS = 8
"""More people than that do not fit into one picture; who comes later is counted and not shown."""
ANCHOR_S = 1.0
"""A stream whose time and arrival drift further apart than this is anchored again."""

Moment = tuple[float, dict[str, Drawing]]
"""Seconds since the view began, and what is drawn then."""


@dataclass(slots=True)
class _Subject:
    place: float
    skeletons: dict[str, Skeleton] = field(default_factory=dict)
    truths: dict[str, Skeleton] = field(default_factory=dict)
    heard_s: dict[tuple[str, bool], float] = field(default_factory=dict)
    silent: set[tuple[str, bool]] = field(default_factory=set)
    calibration: Calibration | None = None
    statuses: dict[str, Status] = field(default_factory=dict)
    offset_s: float | None = None
    body_lean: tuple[float, ...] = ()
    trails: dict[str, HandTrail] = field(default_factory=dict)
    raw: dict[str, RawSignals] = field(default_factory=dict)


class Picture:
    """Feed it with messages; ask it often for what time alone changes. Times are s since the view began."""

    def __init__(self, *, recorded: bool = False) -> None:
        """`recorded`: the pictures are of the past and can be played."""
        self._recorded = recorded
        self._subjects: dict[str, _Subject] = {}
        self._calibrations: dict[str, Calibration] = {}
        self._arms: list[Arm] = []
        self._angles: set[str] = set()
        self._arranged: Layout | None = None
        self._changed_s = 0.0
        self._slow_s = -SLOW_S
        self.turned_away = 0

    def feed(self, subject: str, topic: str, detail: str, message: Message, now_s: float) -> Moment | None:
        """Take one message; return what it changes in the picture and the moment it belongs to."""
        if subject not in self._subjects and len(self._subjects) >= MAX_SUBJECTS:
            self.turned_away += 1
            return None
        if isinstance(message, Skeleton):
            return self._skeleton(subject, message, topic == "truth", now_s)
        if isinstance(message, Calibration) and (
            subject in self._subjects or len(self._calibrations) < MAX_SUBJECTS
        ):
            self._calibrations[subject] = message
        elif isinstance(message, Status) and subject in self._subjects and detail in SEGMENTS:
            self._subjects[subject].statuses[detail] = message
        elif isinstance(message, SampleBatch) and subject in self._subjects and detail in SEGMENTS:
            return self._raw(subject, detail, message, now_s)
        return None

    def tick(self, now_s: float) -> dict[str, Drawing]:
        """Return what is due at this moment: streams that fell silent, words, reference lines, the layout."""
        out: dict[str, Drawing] = {}
        for name, subject in self._subjects.items():
            for (side, truth), heard_s in subject.heard_s.items():
                if now_s - heard_s > SILENT_S and (side, truth) not in subject.silent:
                    subject.silent.add((side, truth))
                    last = (subject.truths if truth else subject.skeletons)[side]
                    out |= draw_silence(name, last, subject.place, truth=truth)
                    if not truth:
                        out[f"world/{name}/{side}_trail"] = subject.trails[side].end()
        if now_s - self._slow_s >= SLOW_S:
            self._slow_s = now_s
            out |= dict(self._words())
            out |= {
                f"angles/{p.angle}/reference": Range(p.low, p.high) for p in PLOTS if p.angle in self._angles
            }
        layout = Layout(
            arms=tuple(self._arms),
            angles=tuple(p.angle for p in PLOTS if p.angle in self._angles),
            title=self._title(),
            raw=tuple(
                (name, seg) for name, one in self._subjects.items() for seg in SEGMENTS if seg in one.raw
            ),
            recorded=self._recorded,
        )
        at_once = self._arranged is None or not self._arranged.arms
        if layout != self._arranged and (at_once or now_s - self._changed_s > SETTLE_S):
            self._arranged = layout
            out["layout"] = layout
        return out

    def _skeleton(self, name: str, skeleton: Skeleton, truth: bool, now_s: float) -> Moment:
        subject = self._subjects.setdefault(name, _Subject(place_of(len(self._subjects))))
        arm = Arm(name, skeleton.side, truth)
        if arm not in self._arms:
            self._arms.append(arm)
            self._changed_s = now_s
        if not skeleton.angles.keys() <= self._angles:
            self._angles |= skeleton.angles.keys()
            self._changed_s = now_s
        (subject.truths if truth else subject.skeletons)[skeleton.side] = skeleton
        subject.heard_s[skeleton.side, truth] = now_s
        subject.silent.discard((skeleton.side, truth))
        drawings = draw_skeleton(name, skeleton, subject.place, truth=truth)
        if not truth or not subject.skeletons:
            drawings |= self._body(name, subject, skeleton)
        time_s = self._moment(subject, skeleton, now_s)
        if not truth:
            colour = ARM_COLOUR[line_colours(self._arms)[name, skeleton.side]]
            trail = subject.trails.setdefault(skeleton.side, HandTrail(colour))
            path = trail.take(time_s, hand_in_picture(skeleton, subject.place))
            if path is not None:
                drawings[f"world/{name}/{skeleton.side}_trail"] = path
        return time_s, drawings

    def _raw(self, name: str, segment: str, batch: SampleBatch, now_s: float) -> Moment:
        """Take samples of somebody whose skeletons come: they give the samples their place in time."""
        subject = self._subjects[name]
        if segment not in subject.raw:
            subject.raw[segment] = RawSignals()
            self._changed_s = now_s
        offset_s = subject.offset_s or 0.0
        return now_s, subject.raw[segment].take(f"raw/{name}/{segment}", read_samples(batch), offset_s)

    def _body(self, name: str, subject: _Subject, skeleton: Skeleton) -> Iterator[tuple[str, Drawing]]:
        tilt = tuple(round(float(x), 3) for x in lean(skeleton))
        if tilt != subject.body_lean:
            subject.body_lean = tilt
            yield f"world/{name}/body", draw_body(skeleton, subject.place)

    def _moment(self, subject: _Subject, skeleton: Skeleton, now_s: float) -> float:
        """Measured time, moved once so that subjects and recordings of other days share one axis."""
        time_s = skeleton.time_ns * 1e-9
        if subject.offset_s is None or abs(now_s - subject.offset_s - time_s) > ANCHOR_S:
            subject.offset_s = now_s - time_s
        return time_s + subject.offset_s

    def _words(self) -> Iterator[tuple[str, Drawing]]:
        sections = []
        for name, subject in self._subjects.items():
            newest = next(iter((subject.skeletons or subject.truths).values()))
            words = f"{name}: {panel.SHORT_ORIGIN[newest.origin]}".rstrip(": ")
            yield f"world/{name}/name", Label((subject.place, 0.0, CHEST_HEIGHT + 0.44), words)
            sections.append(
                panel.describe(
                    name,
                    subject.skeletons or subject.truths,
                    self._calibrations.get(name),
                    subject.statuses,
                    silent=bool(subject.silent),
                )
            )
        key = panel.key(line_colours(self._arms), truth=any(arm.truth for arm in self._arms))
        sections = [*sections, key] if sections else [panel.WAITING]
        yield "words", Text("\n\n".join([*sections, f"*{panel.NOT_A_DEVICE}*"]))

    def _title(self) -> str:
        words = sorted(
            {
                panel.SHORT_ORIGIN[skeleton.origin]
                for subject in self._subjects.values()
                for skeleton in (subject.skeletons or subject.truths).values()
            }
            - {""}
        )
        return "Arm" + (f" ({', '.join(words)})" if words else "")
