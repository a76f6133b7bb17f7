"""The secrets of a room, made once and kept for this user only: its password and the nodes' join token."""

import json
import os
import secrets
from dataclasses import asdict, dataclass
from pathlib import Path

_ALPHABET = "abcdefghjkmnpqrstuvwxyz23456789"
"""Nothing that is read or typed wrongly: no i, l, o, 0, 1."""


@dataclass(frozen=True, kw_only=True)
class RoomSecrets:
    """What lets programs and wearables in."""

    password: str
    """For programs: 80 bits in four groups."""
    join_token: str
    """For wearables that no site file names yet."""


def room_folder(room: str) -> Path:
    """Return the folder in which this user keeps what belongs to a room."""
    state = os.environ.get("XDG_STATE_HOME") or Path.home() / ".local" / "state"
    return Path(state) / "brachium" / room


def load_or_make(folder: Path) -> RoomSecrets:
    """Return the secrets kept in `folder`, made the first time; ValueError for another form of file."""
    path = folder / "secrets.json"
    if not path.exists():
        made = RoomSecrets(password=_word(), join_token=_word())
        _write_private(path, json.dumps(asdict(made), indent=2))
        return made
    try:
        return RoomSecrets(**json.loads(path.read_text("utf-8")))
    except (TypeError, json.JSONDecodeError):
        raise ValueError(f"{path} does not hold a room's secrets; delete it to have new ones made") from None


def write_users(folder: Path, user: str, password: str) -> Path:
    """Write the file from which the router knows who may attach, and return its path."""
    path = folder / "users.txt"
    _write_private(path, f"{user}:{password}\n")
    return path


def _word() -> str:
    return "-".join("".join(secrets.choice(_ALPHABET) for _ in range(4)) for _ in range(4))


def _write_private(path: Path, text: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
    path.unlink(missing_ok=True)
    with os.fdopen(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "w") as file:
        file.write(text)
