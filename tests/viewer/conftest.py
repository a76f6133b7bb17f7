"""A moving arm as skeletons, a router to send them through, and the view that shows them."""

import ast
import errno
import os
import re
import threading
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from brachium_body import rotation
from brachium_router.config import RouterSettings, endpoint
from brachium_router.service import run as run_router
from brachium_viewer.live import ViewSettings
from brachium_viewer.live import run as run_view
from brachium_wire import growing_file
from brachium_wire.messages import SegmentPose, Skeleton

LENGTHS = (0.31, 0.26, 0.18)
START_S = 60.0
ENDS_WITHIN_S = 15.0
"""A service promises 2 s; a machine with much to do takes some times that. One that hangs is not excused."""


@pytest.fixture
def arm_at() -> Callable[..., Skeleton]:
    """A function of seconds that gives the skeleton of an arm that swings; its bones are LENGTHS long."""

    def skeleton(
        seconds: float,
        *,
        side: str = "right",
        origin: str = "emulated",
        quality: str = "good",
        time_ns: int | None = None,
        trunk_from_world: tuple[float, ...] = (1.0, 0.0, 0.0, 0.0),
        off: float = 0.0,
    ) -> Skeleton:
        sign = 1.0 if side == "right" else -1.0
        flexion = np.radians(45.0 + 35.0 * np.sin(0.9 * seconds) + off)
        abduction = np.radians(22.0 + 14.0 * np.sin(0.5 * seconds))
        elbow = np.radians(70.0 + 45.0 * np.sin(1.3 * seconds) + off)
        wrist = np.radians(18.0 * np.sin(2.0 * seconds))
        turns = [rotation.multiply(rotation.about(1, -sign * abduction), rotation.about(0, flexion))]
        turns.append(rotation.multiply(turns[0], rotation.about(0, elbow)))
        turns.append(rotation.multiply(turns[1], rotation.about(0, wrist)))
        points = [np.array([sign * 0.19, 0.0, 0.0])]
        for turn, length in zip(turns, LENGTHS, strict=True):
            points.append(points[-1] + rotation.rotate(turn, (0.0, 0.0, -length)))
        names = [f"{part}_{side[0]}" for part in ("upper_arm", "forearm", "hand")]
        return Skeleton(
            time_ns=time_ns if time_ns is not None else int(1e18 + 1e9 * seconds),
            side=side,
            origin=origin,
            forward="facing",
            trunk_from_world=trunk_from_world,
            segments={
                name: SegmentPose(quality=quality, sequence=7, world_from_segment=tuple(map(float, turn)))
                for name, turn in zip(names, turns, strict=True)
            },
            positions={
                name: tuple(map(float, point))
                for name, point in zip(("shoulder", "elbow", "wrist", "hand"), points, strict=True)
            },
            angles={
                "shoulder_flexion": float(flexion),
                "shoulder_abduction": float(abduction),
                "shoulder_rotation": float(np.radians(15.0 * np.sin(0.7 * seconds))),
                "elbow_flexion": float(elbow),
                "forearm_pronation": float(np.radians(40.0 * np.sin(seconds))),
                "wrist_flexion": float(wrist),
                "wrist_deviation": float(np.radians(8.0 * np.sin(1.7 * seconds))),
            },
        )

    return skeleton


@pytest.fixture
def router_endpoint(unused_port: Callable[[], int]) -> Iterator[str]:
    """The endpoint of a router that runs as long as the test."""
    settings = RouterSettings(port=unused_port())
    stop = threading.Event()
    thread = threading.Thread(target=run_router, args=(settings, stop))
    thread.start()
    yield endpoint(settings)
    stop.set()
    thread.join(ENDS_WITHIN_S)
    assert not thread.is_alive()


class Running:
    """A view in a thread: its address, and its end."""

    def __init__(self, endpoint: str, **settings: object) -> None:
        self.stop = threading.Event()
        self.address: str | None = None
        self.error: Exception | None = None
        self.settings = ViewSettings(
            endpoint=endpoint, web=True, web_port=0, grpc_port=0, on_address=self._ready, **settings
        )
        self._open = threading.Event()
        self.thread = threading.Thread(target=self._run)
        self.thread.start()
        assert self._open.wait(START_S)

    def _ready(self, address: str) -> None:
        self.address = address
        self._open.set()

    def _run(self) -> None:
        try:
            run_view(self.settings, self.stop)
        except Exception as error:
            self.error = error
        finally:
            self._open.set()


@contextmanager
def _view(endpoint: str, **settings: object) -> Iterator[Running]:
    running = Running(endpoint, **settings)
    try:
        yield running
    finally:
        running.stop.set()
        running.thread.join(ENDS_WITHIN_S)
        assert not running.thread.is_alive(), "the view did not end"


@pytest.fixture
def open_view() -> Callable[..., AbstractContextManager[Running]]:
    """The view of a router's room as a context manager; it must end when told."""
    return _view


@pytest.fixture
def disk(monkeypatch: pytest.MonkeyPatch) -> SimpleNamespace:
    """A disk that takes `room` bytes of every recording, and `reserve` more once a reserve was given back."""
    one = SimpleNamespace(room=1 << 30, reserve=0)
    push, release = growing_file.GrowingFile.push, growing_file.GrowingFile.release
    reserve = growing_file.GrowingFile.reserve

    def kept(file: growing_file.GrowingFile, size: int) -> None:
        if not one.room:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        reserve(file, size)

    def bounded(file: growing_file.GrowingFile) -> None:
        if file.tell() > one.room:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        push(file)

    def given_back(file: growing_file.GrowingFile) -> None:
        one.room += one.reserve
        release(file)

    monkeypatch.setattr(growing_file.GrowingFile, "reserve", kept)
    monkeypatch.setattr(growing_file.GrowingFile, "push", bounded)
    monkeypatch.setattr(growing_file.GrowingFile, "release", given_back)
    return one


BLANK = re.compile(r"\{[^{}]*\}")
WORD = re.compile(r"[A-Za-z']+")


def literals(path: Path) -> Iterator[str]:
    """Return a module's texts, f-strings with `{}` for each value; docstrings and logs are left out."""
    tree = ast.parse(path.read_text("utf-8"))
    aside: set[ast.AST] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
            aside.add(node.value)
        elif isinstance(node, ast.JoinedStr):
            aside.update(part for value in node.values for part in ast.walk(value) if part is not node)
            aside -= {
                part
                for value in node.values
                if isinstance(value, ast.FormattedValue)
                for part in ast.walk(value.value)
                if isinstance(part, ast.JoinedStr | ast.Constant)
            }
        elif isinstance(node, ast.Call) and ast.unparse(node.func).startswith("log."):
            aside.update(ast.walk(node))
    for node in ast.walk(tree):
        if node in aside:
            continue
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            yield BLANK.sub("{}", node.value)
        elif isinstance(node, ast.JoinedStr):
            yield "".join(str(v.value) if isinstance(v, ast.Constant) else "{}" for v in node.values)


@pytest.fixture(scope="session")
def texts_in() -> Callable[[Path], list[str]]:
    """The texts in a module's code, f-strings with `{}` for each value."""
    return lambda path: list(literals(path))


def is_sentence(text: str) -> bool:
    """Two words or more; a key, a unit or a name is one."""
    return sum(WORD.fullmatch(word.strip(",.;:()?")) is not None for word in text.split()) >= 2


@pytest.fixture(scope="session")
def check_lines() -> Callable[[dict[str, str], set[str], set[str], set[str]], None]:
    """Holds of a catalogue's lines that each sentence of `said` but those of `elsewhere` has one, that each
    line is of a text of `said` or `made`, and that none has blanks that its sentence has not."""

    def check(lines: dict[str, str], said: set[str], elsewhere: set[str], made: set[str]) -> None:
        keys = {BLANK.sub("{}", key) for key in lines}
        assert sorted({text for text in said if is_sentence(text)} - elsewhere - keys) == []
        assert sorted(keys - said - made) == []
        assert sorted(elsewhere - said) + sorted(made - keys) == []  # nothing stands aside in vain
        for key, text in lines.items():
            assert set(BLANK.findall(text)) <= set(BLANK.findall(key)), key
            assert text.strip(), key

    return check
