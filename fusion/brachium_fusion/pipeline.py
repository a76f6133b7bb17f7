"""The heart: messages in, skeletons out. A value: no socket, thread, clock, file or environment.

The live service, playback, the offline solver and the tests run this same object. Feed it every message in
order
of arrival; after each it solves what became solvable, so that how messages were bunched on their way plays
no part.
Orientations are found sample by sample as they come; the kinematics of all arms wait for `skeletons`, which
solves
everything that piled up in one go over arrays of arms.
"""

from collections import Counter
from collections.abc import Sequence
from typing import Any, NamedTuple

import msgpack
import msgspec

from brachium_fusion.arms import Arms
from brachium_fusion.calibration_wish import checked_wish, checked_zero
from brachium_fusion.guided import FitRequest
from brachium_fusion.pose import Alignment
from brachium_fusion.rows import Row, rows_of
from brachium_fusion.session_terms import check_session
from brachium_fusion.settings import Change, Settings
from brachium_fusion.subject import Subject
from brachium_wire import keys
from brachium_wire.codec import WireError, decode_batch, decode_topic, encode
from brachium_wire.messages import Calibration, Info, SampleBatch, Session, Skeleton, Snapshot
from brachium_wire.samples import Samples, read_many
from brachium_wire.topics import TOPICS

_IMU_BYTES = TOPICS["imu"].max_bytes


class Solved(NamedTuple):
    """A skeleton and whose it is."""

    subject: str
    skeleton: Skeleton


class Pipeline:
    """Many subjects at once. Drops are counted by reason, per subject and for the whole."""

    def __init__(self, settings: Settings | None = None) -> None:
        self.settings = settings or Settings()
        self.subjects: dict[str, Subject] = {}
        self.drops: Counter[str] = Counter()
        """What could not be given to any subject."""
        self.calibrations: list[tuple[str, Calibration]] = []
        """News of calibrations since they were last taken away."""
        self._arms = Arms(self.settings)
        self._rows: list[Row] = []

    def feed(self, key: keys.Key, payload: bytes) -> None:
        """Take the bytes of a sensor's `imu` or `info` topic; other topics do not concern it."""
        self.feed_all([(key, payload)])

    def feed_all(self, messages: Sequence[tuple[keys.Key, bytes]]) -> None:
        """Take many messages in order of arrival, with the same outcome as one by one."""
        batches: list[SampleBatch] = []
        opened: list[WireError | None] = []
        for key, payload in messages:
            if key.topic != "imu":
                continue
            try:
                batches.append(decode_batch(payload, _IMU_BYTES))
                opened.append(None)
            except WireError as error:
                opened.append(error)
        samples = iter(read_many(batches))
        closed = iter(opened)
        for key, payload in messages:
            if key.topic == "imu":
                result = next(closed) or next(samples)
                if isinstance(result, WireError):
                    self._refuse(key, result)
                else:
                    self.samples(key.subject, key.detail, result)
            elif key.topic == "info":
                self._inform(key, payload)

    def _inform(self, key: keys.Key, payload: bytes) -> None:
        try:
            info = decode_topic(payload, "info")
        except WireError as error:
            self._refuse(key, error)
            return
        assert isinstance(info, Info)
        self.subject(key.subject).inform(key.detail, info)

    def samples(self, subject_id: str, segment: str, samples: Samples) -> None:
        """Take a batch of samples."""
        subject = self.subject(subject_id)
        subject.feed(segment, samples)
        self._collect(subject_id, subject)

    def apply(self, subject_id: str, change: Change) -> None:
        """Take a change of a subject's session, or the wish for a calibration.

        Raises ValueError for one that cannot be applied, before it can disturb anything.
        """
        if change.kind == "session":
            try:
                check_session(msgspec.convert(change.data, Session))
            except msgspec.ValidationError as error:
                raise ValueError(f"session: {error}") from None
        elif change.kind == "calibrate":
            checked_wish(change.data)
        elif change.kind == "zero":
            checked_zero(change.data)
        elif change.kind == "align":
            _check_alignment(change.data)
        else:
            raise ValueError(f"change {change.kind!r} is not known; it is session, calibrate, zero or align")
        self.subject(subject_id).apply(change)

    def finish(self) -> None:
        """Nothing more will come: solve what still waited."""
        for subject_id, subject in self.subjects.items():
            subject.finish()
            self._collect(subject_id, subject)

    def skeletons(self) -> list[Solved]:
        """Return the skeletons of every instant solved since the last call, each subject's in order of
        time."""
        rows, self._rows = self._rows, []
        return [
            Solved(row.subject, skeleton) for row, skeleton in zip(rows, self._arms.solve(rows), strict=True)
        ]

    def subject(self, subject_id: str) -> Subject:
        """Return one subject; it begins with its first message."""
        subject = self.subjects.get(subject_id)
        if subject is None:
            subject = Subject(self.settings, lambda news: self.calibrations.append((subject_id, news)))
            self.subjects[subject_id] = subject
        return subject

    def fits(self) -> list[tuple[str, FitRequest]]:
        """Take away the alignments that wait to be found; what is found comes back as a change `align`."""
        waiting = []
        for subject_id, subject in self.subjects.items():
            waiting += [(subject_id, request) for request in subject.calibrating.fits]
            subject.calibrating.fits = []
        return waiting

    def snapshot(self, subject_id: str) -> bytes:
        """Return a Snapshot message of one subject: settings and whole state after all that was fed.

        Call it when `skeletons` has taken everything; rows that still wait are not part of it.
        """
        subject = self.subject(subject_id)
        state = {"subject": subject.state(), "arms": self._arms.state(subject_id)}
        return encode(
            Snapshot(
                time_ns=subject.received_ns,
                settings=self.settings.plain(),
                state=msgpack.packb(state) or b"",
            )
        )

    def restore(self, subject_id: str, snapshot: Snapshot) -> None:
        """Put one subject back to where a snapshot was taken."""
        state: dict[str, Any] = msgpack.unpackb(snapshot.state, strict_map_key=False)
        self.subject(subject_id).restore(state["subject"])
        self._arms.restore(subject_id, state["arms"])

    def _collect(self, subject_id: str, subject: Subject) -> None:
        for instant in subject.instants():
            self._rows.extend(rows_of(subject_id, subject, instant))

    def _refuse(self, key: keys.Key, error: WireError) -> None:
        subject = self.subjects.get(key.subject)
        (self.drops if subject is None else subject.drops)[error.drop.value] += 1


def _check_alignment(data: dict[str, Any]) -> None:
    try:
        Alignment.from_state(data["alignment"])
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise ValueError(f"align: no alignment: {error!r}") from None
