"""A recording in the view: the same pictures as live, at the recording's own times."""

import logging
import threading
from collections.abc import Iterable, Iterator, Mapping
from contextlib import ExitStack
from pathlib import Path

from brachium_viewer.drawings import Drawing, Signal
from brachium_viewer.live import ViewSettings, opened
from brachium_viewer.picture import Moment, Picture
from brachium_viewer.raw_signals import joined
from brachium_viewer.viewer_process import ViewerProcess, ViewError
from brachium_wire import keys, recording
from brachium_wire.codec import WireError, decode_topic
from brachium_wire.recording import Recorded

log = logging.getLogger(__name__)

RATE_HZ = 20.0
"""Pictures a second: twenty minutes of both arms are sent in about half a minute."""
SHOWN = ("skeleton", "truth", "status", "calibration")
RAW_S = 2.0
"""Raw signals are drawn in pieces of so long."""
FLUSH_EVERY = 200
"""Moments between two waits for the viewer."""


def moments(
    messages: Iterable[Recorded], *, at_s: float = 0.0, subject: str = "*", raw: bool = False
) -> Iterator[Moment]:
    """Yield what is drawn of a recording from `at_s` on, in s from its first message.

    What cannot be read is left out. Of what was before only calibrations and states of sensors count.
    """
    picture, start_ns, due_s = Picture(recorded=True), 0, at_s
    newest: dict[str, tuple[keys.Key, bytes]] = {}
    signals, sent_s = dict[str, Signal](), at_s
    for key, payload, log_ns in messages:
        start_ns = start_ns or log_ns
        now_s = 1e-9 * (log_ns - start_ns)
        while now_s >= due_s and (newest or now_s < due_s + 1.0):
            yield from _drawn(picture, newest, due_s)
            newest, due_s = {}, due_s + 1.0 / RATE_HZ
        if now_s >= due_s:  # nothing came for a while
            yield due_s, picture.tick(due_s)
            due_s = now_s
        try:
            where = keys.parse(key)
        except keys.BadKey:
            continue
        if subject not in ("*", where.subject) or (where.topic in ("skeleton", "truth") and now_s < at_s):
            continue
        if where.topic in SHOWN:
            newest[key] = where, payload
        elif raw and where.topic == "imu" and now_s >= at_s:
            for _, drawings in _fed(picture, where, payload, now_s):
                _gather(signals, drawings)
            if now_s >= sent_s + RAW_S:
                yield now_s, dict(signals)
                signals, sent_s = {}, now_s
    yield from _drawn(picture, newest, due_s)
    if signals:
        yield due_s, dict(signals)


def run(path: Path, at_s: float, settings: ViewSettings, stop: threading.Event) -> None:
    """Show a recording from `at_s` on until `stop` is set or the window is closed.

    Raises RecordingError, FileNotFoundError, and ViewError as the live view does, or when nothing is there to
    be shown.
    """
    if at_s > 0.0:
        _check_begin(path, at_s)
    with ExitStack() as stack:
        messages = stack.enter_context(recording.read(path))
        viewer = opened(stack, settings, stop)[0]
        drawn = moments(messages, at_s=at_s, subject=settings.subject, raw=settings.raw)
        _send(drawn, path, viewer, stop)
        if messages.warning:
            log.warning("%s", messages.warning)
        while not stop.is_set() and viewer.running():
            stop.wait(0.1)


def _check_begin(path: Path, at_s: float) -> None:
    """Raise ViewError, before anything opens, when no arm is there from `at_s` on."""
    start_ns, last_s = 0, 0.0
    with recording.read(path) as messages:
        for key, _, log_ns in messages:
            start_ns = start_ns or log_ns
            last_s = 1e-9 * (log_ns - start_ns)
            if last_s >= at_s and "/skeleton/" in key:
                return
    raise ViewError(
        f"{path}: no skeletons from {at_s:g} s on, it ends at {last_s:.0f} s; choose another --at"
    )


def _send(drawn: Iterator[Moment], path: Path, viewer: ViewerProcess, stop: threading.Event) -> None:
    import rerun as rr

    from brachium_viewer.screen import APPLICATION, Pen

    stream = rr.RecordingStream(APPLICATION, recording_id=path.stem)
    stream.connect_grpc(viewer.url)
    pen, arms, last_s = Pen(stream), False, 0.0
    for number, (time_s, drawings) in enumerate(drawn):
        if stop.is_set() or not viewer.running():
            return
        pen.write({name: (time_s, drawing) for name, drawing in drawings.items()})
        arms, last_s = arms or any(name.startswith("world/") for name in drawings), time_s
        if number % FLUSH_EVERY == 0:
            stream.flush()
    stream.flush()
    if not arms:
        raise ViewError(f"{path}: no skeletons to show up to its end at {last_s:.0f} s")
    log.info("%s: shown up to its end at %.0f s", path, last_s)


def _drawn(picture: Picture, news: dict[str, tuple[keys.Key, bytes]], now_s: float) -> Iterator[Moment]:
    for where, payload in news.values():
        yield from _fed(picture, where, payload, now_s)
    due = picture.tick(now_s)
    if due:
        yield now_s, due


def _fed(picture: Picture, where: keys.Key, payload: bytes, now_s: float) -> Iterator[Moment]:
    try:
        message = decode_topic(payload, where.topic)
        moment = picture.feed(where.subject, where.topic, where.detail, message, now_s)
    except WireError:
        return
    if moment is not None:
        yield moment


def _gather(signals: dict[str, Signal], drawings: Mapping[str, Drawing]) -> None:
    """Add signals to those that wait: thousands of small pieces would be slow to draw."""
    for path, drawing in drawings.items():
        if isinstance(drawing, Signal):
            signals[path] = joined(signals[path], drawing) if path in signals else drawing
