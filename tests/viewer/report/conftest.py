"""The recordings of sessions, as the sessions' own tests write them."""

import importlib.util
from pathlib import Path
from typing import Any

import pytest

from brachium_viewer import marks

_SPEC = importlib.util.spec_from_file_location(
    "session_scripts", Path(__file__).parents[1] / "sessions" / "conftest.py"
)
assert _SPEC is not None
assert _SPEC.loader is not None
scripts: Any = importlib.util.module_from_spec(_SPEC)
_SPEC.loader.exec_module(scripts)


def write_session(path: Path, origin: Any = "worn", top_deg: float = 100.0) -> Path:
    """Write both arms' elbow flexion, active and passive, and an exercise that was not measured."""
    one = scripts.Script("p01", origin)
    for mark in (marks.Pain(value=2, when="before"), marks.Effort(value=1, when="before")):
        one.mark(mark)
    one.set(5, top_deg, goal_deg=90.0, repetitions=10)
    one.mark(marks.Donning())
    one.set(5, top_deg)
    one.set(2, top_deg + 8.0, mode="passive", limit_deg=top_deg)
    one.set(2, top_deg - 20.0, side="left")
    one.mark(marks.ExerciseBegins(exercise="wrist-flexion", side="right"))
    one.move(2, 50.0)
    one.mark(marks.ExerciseEnds(reason="patient-stop"))
    one.mark(marks.PatientStop())
    one.now_s += 3.0
    one.mark(marks.PatientStop(reason="dizzy"))
    one.status()
    one.mark(marks.Pain(value=5, when="after"))
    return scripts.write(path, [one])  # type: ignore[no-any-return]


@pytest.fixture(scope="session")
def worn(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_session(tmp_path_factory.mktemp("worn") / "worn.mcap")


@pytest.fixture(scope="session")
def emulated(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_session(tmp_path_factory.mktemp("emulated") / "emulated.mcap", "emulated")


@pytest.fixture(scope="session")
def impossible(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a session whose elbow bends farther than one can."""
    return write_session(tmp_path_factory.mktemp("impossible") / "impossible.mcap", top_deg=175.0)


@pytest.fixture(name="scripts", scope="session")
def _scripts() -> Any:
    return scripts
