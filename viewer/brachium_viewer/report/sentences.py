"""The report's sentences: facts, how zero was set, warnings, method. Pure but for the version's number."""

from importlib import metadata

from brachium_body.lengths import from_measured
from brachium_viewer.exercises import PLANES_DEG
from brachium_viewer.metrics.kinematics import SPEED_CUTOFF_HZ
from brachium_viewer.metrics.repetition_measures import SMOOTH_GAP_S
from brachium_viewer.metrics.repetitions import CUTOFF_HZ as LOW_PASS_HZ
from brachium_viewer.metrics.smoothness import CUTOFF_HZ, LDLJ_RATE_HZ
from brachium_viewer.metrics.way_there import SLOW, SWAY_DEG_S
from brachium_viewer.report import report_tables as tables
from brachium_viewer.report import words
from brachium_viewer.report.build import Report
from brachium_viewer.report.implausible import implausible
from brachium_viewer.sessions.from_recording import readable, stops_between_sets
from brachium_viewer.sessions.records import METHOD
from brachium_wire.messages import Session


def facts(report: Report) -> list[str]:
    """Return the line under the heading."""
    minutes = report.contents.duration_s / 60.0
    found = [tables.date(report.session.started_ns), f"{minutes:.0f} min" if minutes >= 2 else "under 2 min"]
    if report.affected:
        found.append(f"affected side: {report.affected}")
    said = report.contents.sessions.get(report.session.subject)
    if said is not None and said.height_m is not None:
        found.append(f"height {said.height_m:.2f} m")
    return [*found, f"recording {report.session.recording}"]


def stops(report: Report) -> list[str]:
    """Return what the patient stopped while no set ran, one line each."""
    marks = readable(report.contents.events.get(report.session.subject, ()))
    found = stops_between_sets(marks, report.session.sets)
    return [f"stopped by the patient between sets: {words.STOP_REASONS[reason]}" for reason in found]


def how_zero_was_set(report: Report) -> str:
    """Return how the angles' zero and forward came about, one sentence."""
    subject = report.session.subject
    found = report.contents.calibrations.get(subject)
    forward = {
        arm.published.last.forward
        for (who, _), arm in report.contents.arms.items()
        if who == subject and len(arm.published)
    }
    facing = "; ".join(words.FORWARD[one] for one in sorted(forward)) or words.FORWARD["none"]
    if found is None or not (found.pose or found.mounting or found.state == "done"):
        return f"The recording holds no calibration. Forward: {facing}."
    pose = f"in pose {found.pose}" if found.pose else "from stated mountings"
    scores = ", ".join(words.scores(found.scores))
    if not scores:
        return f"Zero {pose}. Forward {facing}."
    return f"Zero {pose}. Forward {facing}. Scores of the calibration: {scores}."


def warnings(report: Report) -> list[str]:
    """Return what a reader must know first."""
    contents, subject = report.contents, report.session.subject
    found = [contents.warning] if contents.warning else []
    calibration = contents.calibrations.get(subject)
    if calibration is not None:
        found += list(calibration.warnings)
        if calibration.state == "refused":
            found.append(f"calibration refused: {calibration.reason}")
        found += [f"{what.replace('_', ' ')} not found: {why}" for what, why in calibration.refused.items()]
    found += [line for line in [contents.clocks.get(subject)] if line]
    found += implausible(report.motions)
    if contents.unreadable:
        counts = contents.unreadable.items()
        told = (f"1 message {why}" if n == 1 else f"{n} messages {why}" for why, n in counts)
        found.append(f"left out: {', '.join(told)}")
    if not report.groups:
        found.append(
            "No exercise is marked in this recording, so nothing was measured: name it with --exercise and "
            "--side."
        )
    return found


def why_no_comparison(report: Report) -> str:
    """Return why no earlier session stands beside this one; empty when one does."""
    if not report.groups or any(past is not None and past.changes for past in report.pasts):
        return ""
    if report.session.origin != "worn":
        return "Not put beside earlier sessions: what nobody wore is kept out of a person's history."
    methods = {past.method for past in report.pasts if past is not None}
    if not methods:
        return "No earlier session of these exercises is known."
    if METHOD in methods:
        return "Not put beside an earlier session: what could be compared is withheld here or there."
    return "Not put beside the last session: its numbers were found by another method; add it anew."


def method(report: Report) -> list[str]:
    """Return how the numbers were found: what one must know to find them again."""
    bands = ", ".join(f"{name} {low:.0f} to {high:.0f}" for name, (low, high) in PLANES_DEG.items())
    fusion = report.contents.fusion.get(report.session.subject, {})
    settings = ", ".join(f"{name} {value}" for name, value in fusion.items() if _plain(value))
    return [
        f"Measures by method {report.session.method}, Brachium {_version()}."
        + (f" Settings of fusion: {settings}." if settings else ""),
        *_way_there(),
        f"Elevation of the arm counts for an exercise in this band of its plane, deg: {bands}. Shoulder "
        f"angles are {words.SHOULDER}.",
        "Ranges are from the resting start to the farthest point held for 0.2 s; where an exercise lowers "
        "its angle, the farthest is the lowest. AAOS reference: ranges of healthy adults in general, not "
        "what is to be expected of one person. Needed by daily activities: by most of them, after Morrey "
        "1981 (elbow, forearm), Ryu 1991 (wrist) and Namdari 2012 (shoulder).",
        *_lengths(report.contents.sessions.get(report.session.subject) or Session()),
    ]


def _way_there() -> list[str]:
    """Return where a repetition's way there begins and ends, and what of it is measured."""
    return [
        f"The way there begins where the speed, of the angle up to {LOW_PASS_HZ:g} Hz, last rises past "
        f"{100 * SLOW:.0f} % of its peak (at least {SWAY_DEG_S:g} deg/s) before the angle leaves the first "
        "tenth of its range, and ends where it first falls below that in the last tenth; both ends are set "
        "off so that a minimum-jerk reach keeps its length. A stop on the way is part of it, holding is not.",
        "Of the way there, up or down, are: movement time; mean speed, how far the angle went over that "
        f"time; peak speed, up to {SPEED_CUTOFF_HZ:.0f} Hz and a tremor's too; time to goal; path and "
        f"straightness; smoothness: SPARC up to {CUTOFF_HZ:.0f} Hz and LDLJ of its speed at "
        f"{LDLJ_RATE_HZ:.0f} Hz, both smoother closer to 0 (a minimum-jerk reach has -1.41 and -5.1), "
        f"withheld where a gap of more than {SMOOTH_GAP_S:g} s is in it.",
    ]


def _lengths(said: Session) -> list[str]:
    """Return how far places may be off because the arm's lengths are estimates; nothing where all were
    measured."""
    try:
        lengths = from_measured(said.lengths_m, said.height_m)
    except ValueError:
        return ["How long the arm is was not told: places and paths are those of an arm of usual length."]
    if not lengths.relative_sd:
        return []
    _, elbow, wrist, hand = 100.0 * lengths.position_sd()
    return [
        "Lengths of the arm are estimated from height: by them alone the places of elbow, wrist and hand may "
        f"be off by {elbow:.1f}, {wrist:.1f} and {hand:.1f} cm (standard deviation)."
    ]


def _plain(value: object) -> bool:
    return isinstance(value, str | int | float) and not isinstance(value, bool)


def _version() -> str:
    try:
        return metadata.version("brachium")
    except metadata.PackageNotFoundError:
        return "from its source tree"
