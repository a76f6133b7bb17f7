"""The recordings of a store's folder: whose they are, and how one person is taken out of them."""

import os
from collections.abc import Collection, Iterator
from pathlib import Path

from brachium_viewer.sessions.records import StoreError
from brachium_wire import keys, recording

PART = ".part"
"""What the name of a file ends in while it is being written."""


def is_of(subject: str, key_subject: str) -> bool:
    """Return whether a key's subject is this one, or its second set of sensors."""
    return key_subject in (subject, subject + keys.REFERENCE)


def recordings(folder: Path) -> Iterator[Path]:
    """Yield the recordings of a folder by name; files that are none are left out."""
    yield from (path for path in sorted(folder.glob("*.mcap")) if recording.is_recording(path))


def subjects_in(path: Path) -> set[str]:
    """Return the subjects of a recording: from its index, or by reading one that was not closed."""
    try:
        names = set(recording.counts(path))
    except recording.RecordingError:
        with recording.read(path) as reading:
            names = {message.key for message in reading}
    found = set()
    for name in names:
        try:
            found.add(keys.parse(name).subject)
        except keys.BadKey:
            continue
    return found - {keys.SERVICE}


def of_subject(folder: Path, subject: str) -> list[tuple[Path, bool]]:
    """Return the recordings that hold a subject, and whether they hold nobody else."""
    found = []
    for path in recordings(folder):
        inside = subjects_in(path)
        if any(is_of(subject, name) for name in inside):
            found.append((path, all(is_of(subject, name) for name in inside)))
    return found


def beside(path: Path) -> list[Path]:
    """Return what was made of a recording and lies beside it: its name, with another ending.

    Another recording is none of it, whatever its name begins with.
    """
    made = (other for other in path.parent.glob(f"{path.stem}.*") if other.suffix != path.suffix)
    return sorted(other for other in made if other.is_file())


def in_no_session(folder: Path, known: Collection[str]) -> list[Path]:
    """Return the recordings that are none of the `known` names and that nobody writes: their server was ended
    before it could keep their session, or they were never meant to be one."""
    return [p for p in recordings(folder) if p.name not in known and not recording.is_being_written(p)]


def copy_of(source: Path, target: Path, subject: str, *, without: bool) -> None:
    """Write `target`: the recording without a subject, or with nobody but that subject; services stay.

    Whole or not at all. Raises FileExistsError when it is there and is not the source.
    """
    if target.exists() and target != source:
        raise FileExistsError(17, "there is a file of that name already", str(target))
    part = target.with_name(target.name + PART)
    part.unlink(missing_ok=True)
    with recording.read(source) as reading, recording.RecordingWriter(part, reading.metadata) as writer:
        for message in reading:
            try:
                whose = keys.parse(message.key).subject
            except keys.BadKey:
                continue
            if whose == keys.SERVICE or is_of(subject, whose) != without:
                writer.write(*message)
    part.replace(target)


def remove(folder: Path, subject: str) -> None:
    """Remove the recordings of a subject and what was made of them; others in the same file stay.

    Done again after a crash it finishes what is left.
    """
    for path, alone in of_subject(folder, subject):
        for other in beside(path):  # reports and exports name whoever was in the recording
            other.unlink(missing_ok=True)
        if alone:
            path.unlink(missing_ok=True)
        else:
            copy_of(path, path, subject, without=True)
    for part in folder.glob(f"*{PART}"):
        part.unlink(missing_ok=True)
    sync(folder)


def check_free(folder: Path, subject: str) -> None:
    """Raise StoreError while one of a subject's recordings is being written."""
    for path, _ in of_subject(folder, subject):
        if recording.is_being_written(path):
            raise StoreError(f"{path.name} is being written; stop the recorder, then delete {subject}")


def sync(folder: Path) -> None:
    """Bring a folder's names to the disk, where the system can."""
    if os.name == "nt":
        return
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
