"""A subject's calibration: what is known, what is waited for, and what is told of it. Pure."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt

from brachium_fusion.guided import FITTING, WORDS, FitRequest, Guided, GuidedWish, Told
from brachium_fusion.pose import Alignment, PoseSensor, align, pose_orientations
from brachium_fusion.pose_watch import STILL_S, HeldPose, Moving, PoseWatch, PoseWish
from brachium_fusion.timeline import Reading
from brachium_fusion.track import SegmentTrack
from brachium_fusion.zero import zeroed
from brachium_wire.messages import Calibration, Quaternion, Session
from brachium_wire.tuples import quaternion

Floats = npt.NDArray[np.float64]


class Calibrating:
    """Poses, guided calibrations and headings set anew, for one subject."""

    def __init__(self, auto_pose: bool, announce: Callable[[Calibration], None]) -> None:
        self._auto_pose, self._announce = auto_pose, announce
        self._watch: PoseWatch | Guided | None = PoseWatch(PoseWish()) if auto_pose else None
        self._zeroing = False
        """What is waited for only sets headings anew."""
        self._fitting_ns: int | None = None
        """Which guided calibration's alignment is being worked out."""
        self.alignment: Alignment | None = None
        self.reference_ns = 0
        """When headings were last set by a pose."""
        self.fits: list[FitRequest] = []
        """Alignments that wait for whoever has time to find them."""

    # -- changes -----------------------------------------------------------------------------------------

    def change(self, now: int, kind: str, data: dict[str, Any]) -> bool:
        """Begin what was asked for, `calibrate` or `zero`, or take what was found, `align`.

        Return whether the alignment is another one now.
        """
        if kind == "align":
            return self._take_found(now, data)
        self._zeroing, self._fitting_ns = kind == "zero", None
        data = dict(data)
        routine, motions = data.pop("routine", "pose"), tuple(data.pop("motions", ()))
        wish = PoseWish(from_ns=now, patient=False, **data)
        self._watch = PoseWatch(wish) if routine == "pose" else Guided(GuidedWish(pose=wish, motions=motions))
        self._say_waiting(now, wish, [])
        return False

    def _take_found(self, now: int, data: dict[str, Any]) -> bool:
        """Take an alignment that was worked out, or kept from another day."""
        of_ns = data.get("from_ns")
        if of_ns is not None and of_ns != self._fitting_ns:
            return False  # something else was asked for meanwhile
        self._fitting_ns = None
        found = Alignment.from_state(data["alignment"])
        if not found.mounting:
            reasons = "; ".join(found.refused.values()) or "nothing was found"
            self.say(now, "refused", reason=reasons, refused=found.refused)
            return False
        self.alignment, self._watch = found, None
        self.reference_ns = now
        if data.get("kept"):
            self._loosen()
        self.say(now, "done", refused=found.refused)
        return True

    def _loosen(self) -> None:
        """A sensor's own heading is another one since it was switched on."""
        assert self.alignment is not None
        loose = {s for s, turn in self.alignment.heading.items() if turn != 0.0}
        self.alignment = replace(self.alignment, assumed=self.alignment.assumed | loose)
        if self._auto_pose and loose:
            self._watch, self._zeroing = PoseWatch(PoseWish(seconds=STILL_S)), True

    def forget(self, segment: str) -> None:
        """Leave aside what a sensor showed that is not there any more."""
        if self._watch is not None:
            self._watch.forget(segment)

    def begin_anew(self, now: int) -> None:
        """Nothing is known any more."""
        self.alignment, self._zeroing, self._fitting_ns = None, False, None
        self._watch = PoseWatch(PoseWish(from_ns=now)) if self._auto_pose else None
        self.say(now, "waiting", reason="another run of these sensors: stand still in the pose")

    def warn(self, now: int, text: str) -> None:
        """Tell something that a person should know of what is calibrated."""
        if self.alignment is not None:
            self.alignment = replace(self.alignment, warnings=(*self.alignment.warnings, text))
            self.say(now, "done" if self._watch is None and self._fitting_ns is None else "running")

    # -- what the sensors show ---------------------------------------------------------------------------

    def see(
        self,
        now: int,
        readings: Mapping[str, Reading | None],
        tracks: Mapping[str, SegmentTrack],
        session: Session,
    ) -> bool:
        """Take the sensors at an instant; return whether the alignment is another one now."""
        watch = self._watch
        if watch is None:
            return False
        live = {s: r for s, r in readings.items() if r is not None and r.quality in ("good", "disturbed")}
        if isinstance(watch, Guided):
            return self._see_guided(now, watch, watch.see(now, live, tracks), tracks, session)
        seen = watch.see(now, live, {s: tracks[s].still_since_ns for s in live})
        if seen is None:
            return False
        if isinstance(seen, Moving):
            self._say_waiting(now, watch.wish, seen.segments)
            return False
        self._watch = None
        if isinstance(seen, str):
            self.say(now, "refused", pose=watch.wish.pose, reason=seen)
            return False
        self._take_pose(seen, tracks, session)
        self.reference_ns = now
        self.say(now, "done", pose=watch.wish.pose)
        return True

    def _see_guided(
        self,
        now: int,
        guided: Guided,
        seen: Told | Moving | FitRequest | str | None,
        tracks: Mapping[str, SegmentTrack],
        session: Session,
    ) -> bool:
        pose = guided.wish.pose.pose
        if isinstance(seen, Told):
            self.say(now, "running", pose=pose, motion=seen.step, progress=seen.progress, reason=seen.words)
        elif isinstance(seen, Moving):
            self._say_waiting(now, guided.wish.pose, seen.segments)
        elif isinstance(seen, FitRequest):
            self._watch, self._fitting_ns = None, seen.from_ns
            self.fits.append(guided.complete(seen, tracks, session.facing_deg))
            self.say(now, "running", pose=pose, progress=FITTING, reason="working it out")
        elif isinstance(seen, str):
            self._watch = None
            self.say(now, "refused", pose=pose, reason=seen)
        return False

    def _take_pose(self, held: HeldPose, tracks: Mapping[str, SegmentTrack], session: Session) -> None:
        if self._zeroing and self.alignment is not None:
            common = frozenset(s for s in held.world_from_sensor if tracks[s].shares_world)
            self.alignment = zeroed(self.alignment, held.world_from_sensor, common)
            return
        sensors = {
            segment: PoseSensor(
                world_from_sensor=quats,
                magnetometer=tracks[segment].shares_world,
                nominal_mounting=_array(tracks[segment].info.mounting),
            )
            for segment, quats in held.world_from_sensor.items()
        }
        targets = pose_orientations(held.pose, held.angles_deg)
        self.alignment = align(sensors, targets, facing_deg=session.facing_deg)

    def _say_waiting(self, now: int, wish: PoseWish, moving: list[str]) -> None:
        self.say(now, "waiting", pose=wish.pose, motion=wish.pose, reason=WORDS[wish.pose], moving=moving)

    def say(
        self,
        now: int,
        state: str,
        *,
        pose: str = "",
        motion: str = "",
        progress: float = 0.0,
        reason: str = "",
        refused: Mapping[str, str] | None = None,
        moving: Sequence[str] = (),
    ) -> None:
        """Tell how far it has come, and what is known."""
        alignment = self.alignment or Alignment()  # what was known before still holds when a pose is refused
        self._announce(
            Calibration(
                time_ns=now,
                state=state,  # type: ignore[arg-type]
                pose=pose,
                motion=motion,
                progress=1.0 if state == "done" else progress,
                reason=reason,
                forward=alignment.forward,
                mounting={s: quaternion(q) for s, q in alignment.mounting.items()},
                scores=alignment.scores,
                warnings=list(alignment.warnings),
                refused=dict(refused or {}),
                moving=list(moving),
            )
        )

    # -- snapshot ----------------------------------------------------------------------------------------

    def state(self) -> dict[str, Any]:
        """Return all that changes, as plain values."""
        guided = isinstance(self._watch, Guided)
        return {
            "watch": None if self._watch is None else self._watch.state(),
            "guided": guided,
            "zeroing": self._zeroing,
            "fitting_ns": self._fitting_ns,
            "alignment": None if self.alignment is None else self.alignment.state(),
            "reference_ns": self.reference_ns,
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Go on as the one whose state this is would have."""
        kept = state["watch"]
        made = Guided if state["guided"] else PoseWatch
        self._watch = None if kept is None else made.from_state(kept)
        self._zeroing, self._fitting_ns = state["zeroing"], state["fitting_ns"]
        self.alignment = None if state["alignment"] is None else Alignment.from_state(state["alignment"])
        self.reference_ns = state["reference_ns"]


def _array(values: Quaternion | None) -> Floats | None:
    return None if values is None else np.array(values, dtype=np.float64)
