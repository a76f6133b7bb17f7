"""What an exported file says of itself, and how `solve --settings` reads it again."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from brachium_viewer.panel import NOT_A_DEVICE
from brachium_wire import table
from brachium_wire.table import Table, TableError

KEY = "brachium"
CHUNK = 120
"""Characters in a row of a C3D parameter, which holds 255 at most."""


def about(source: Table, made_by: str, **cut: Any) -> dict[str, Any]:
    """Return what a file made of `source` says of itself; `cut` names what was left out or resampled."""
    made = {name: value for name, value in cut.items() if value is not None}
    return {
        **source.metadata,
        "made_by": made_by,
        "notice": NOT_A_DEVICE,
        "origin": source.metadata.get("origin", "not told"),
        **({"export": made} if made else {}),
    }


def one_line(said: dict[str, Any]) -> str:
    """Return it as one line of plain ASCII without `=`, which headers of OpenSim's files take for theirs."""
    return json.dumps(said, ensure_ascii=True, allow_nan=False).replace("=", "\\u003d")


def sidecar(path: Path) -> Path:
    """Return the file beside one whose format has no room: `arm.trc.json` beside `arm.trc`."""
    return path.with_name(path.name + ".json")


def write_sidecar(path: Path, said: dict[str, Any]) -> Path:
    """Write what a file says of itself beside it."""
    beside = sidecar(path)
    beside.write_text(json.dumps(said, indent=2, allow_nan=False) + "\n", encoding="utf-8")
    return beside


def carried(path: Path) -> dict[str, Any]:
    """Return what an exported file, or the file beside it, says of itself.

    Raises TableError where nothing is told, FileNotFoundError.
    """
    if path.is_dir():
        found = sorted(path.rglob("*_motion.json"))
        if len(found) != 1:
            raise TableError(f"{path}: holds {len(found)} *_motion.json; name the one that is meant")
        return carried(found[0])
    if not path.exists():
        raise FileNotFoundError(2, "No such file or directory", str(path))
    reader = _READERS.get(path.suffix)
    try:
        said = reader(path) if reader else _beside(path)
    except (ValueError, KeyError, UnicodeDecodeError) as error:
        raise TableError(f"{path}: does not tell its settings ({error})") from None
    return said


def settings(path: Path) -> dict[str, Any]:
    """Return the settings with which the numbers in an exported file were solved. Raises as `carried`."""
    said = carried(path)
    found = said.get("settings")
    if not isinstance(found, dict):
        raise TableError(f"{path}: does not tell the settings it was solved with; made by another program?")
    return found


def _beside(path: Path) -> dict[str, Any]:
    if not sidecar(path).exists():
        raise ValueError(f"there is no {sidecar(path).name} beside it")
    return _json(sidecar(path))


def _json(path: Path) -> dict[str, Any]:
    said = json.loads(path.read_text(encoding="utf-8"))
    if not isinstance(said, dict):
        raise ValueError("its JSON is no object")
    inner = said.get(KEY)
    return inner if isinstance(inner, dict) else said


def _header_line(path: Path) -> dict[str, Any]:
    with path.open(encoding="utf-8") as file:
        for line in file:
            if line.startswith(f"{KEY}="):
                said: dict[str, Any] = json.loads(line.partition("=")[2])
                return said
            if line.strip() == "endheader":
                break
    raise ValueError("its header has no line for it")


def _c3d(path: Path) -> dict[str, Any]:
    import ezc3d

    parameters = ezc3d.c3d(str(path))["parameters"]
    if KEY.upper() not in parameters:
        raise ValueError("it has no parameter for it")
    said: dict[str, Any] = json.loads("".join(parameters[KEY.upper()]["ABOUT"]["value"]))
    return said


_READERS: dict[str, Callable[[Path], dict[str, Any]]] = {
    ".csv": lambda path: table.read(path).metadata,
    ".parquet": lambda path: table.read(path).metadata,
    ".json": _json,
    ".sto": _header_line,
    ".mot": _header_line,
    ".c3d": _c3d,
}
