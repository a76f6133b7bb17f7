"""Calibrations kept on disk, one file a subject, so that fusion that starts again does not forget them.

A file holds pseudonyms only: the subject's id and the nodes' ids. It is replaced in one step.
"""

import json
import logging
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from brachium_wire.keys import subject_chunk
from brachium_wire.messages import Info

log = logging.getLogger(__name__)

VERSION = 1


def state_folder() -> Path:
    """Return where calibrations are kept when nobody says where: below XDG_STATE_HOME."""
    base = os.environ.get("XDG_STATE_HOME") or Path.home() / ".local" / "state"
    return Path(base) / "brachium" / "calibrations"


class Kept:
    """The calibrations of a folder."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def load(self, room: str, subject: str) -> dict[str, Any] | None:
        """Return what is kept of a subject: `sensors` (node by segment) and `alignment`; None without it.

        A file that cannot be used is left where it is, and said so.
        """
        path = self._path(room, subject)
        try:
            kept = json.loads(path.read_text("utf-8"))
            if kept["version"] != VERSION:
                raise ValueError(f"version {kept['version']!r}, expected {VERSION}")
            found = {"sensors": dict(kept["sensors"]), "alignment": dict(kept["alignment"])}
        except FileNotFoundError:
            return None
        except (OSError, ValueError, KeyError, TypeError) as error:
            log.warning("%s: calibration left aside: %s", path, error)
            return None
        return found

    def save(
        self, room: str, subject: str, infos: Mapping[str, Info], alignment: Mapping[str, Any], time_ns: int
    ) -> None:
        """Keep an alignment of the sensors that `infos` describe. What cannot be written is said, no more."""
        path = self._path(room, subject)
        content = {
            "version": VERSION,
            "subject": subject,
            "time_ns": time_ns,
            "sensors": {segment: info.node for segment, info in sorted(infos.items())},
            "alignment": alignment,
        }
        try:
            path.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
            other = path.with_suffix(f".{os.getpid()}.new")
            with other.open("w", encoding="utf-8") as file:
                json.dump(content, file, allow_nan=False)
                file.flush()
                os.fsync(file.fileno())
            other.replace(path)
        except (OSError, ValueError) as error:
            log.warning("%s: calibration not kept: %s", path, error)

    def _path(self, room: str, subject: str) -> Path:
        return self.folder / room / f"{subject_chunk(subject)}.json"


def same_sensors(kept: Mapping[str, str], infos: Mapping[str, Info]) -> bool:
    """Return whether the nodes that a calibration was made with are worn, each where it was."""
    return bool(kept) and all(
        segment in infos and infos[segment].node == node and infos[segment].origin == "worn"
        for segment, node in kept.items()
    )
