"""A subject as one zip: what the store keeps of them, their recordings, and a checksum of each.

Everything in a zip that comes from elsewhere is doubted: names that lead out of the folder, files that are
more than they say, sums that differ, recordings of other people, and sessions that call themselves worn and
are not.
"""

import hashlib
import sqlite3
import zipfile
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory

import msgspec

from brachium_viewer.contents import load
from brachium_viewer.sessions import folder as files
from brachium_viewer.sessions.from_recording import origin
from brachium_viewer.sessions.records import SessionRecord, StoreError, Subject
from brachium_viewer.sessions.schema import VERSION
from brachium_viewer.sessions.store import Store
from brachium_wire import keys, recording

MANIFEST = "subject.json"
MANIFEST_BYTES = 64 << 20
"""More than a thousand sessions hold."""
BLOCK = 1 << 20


@dataclass(frozen=True, kw_only=True)
class Packed:
    """One recording in the zip."""

    name: str
    size: int
    sha256: str


@dataclass(frozen=True, kw_only=True)
class Manifest:
    """What stands in MANIFEST."""

    version: int
    subject: Subject
    sessions: tuple[SessionRecord, ...]
    files: tuple[Packed, ...]


def pack(store: Store, pseudonym: str, out: Path) -> Manifest:
    """Write everything of a subject to a new zip; others in the same recordings stay out of it.

    Raises StoreError for a subject that is not known, and FileExistsError when `out` is there.
    """
    subject = store.subject(pseudonym)
    if subject is None:
        raise StoreError(f"there is no subject {pseudonym!r} in {store.folder}")
    sessions = tuple(replace(one, id=None) for one in reversed(store.sessions(pseudonym)))
    packed = []
    with (
        TemporaryDirectory(dir=out.parent) as scratch,
        zipfile.ZipFile(out, "x", zipfile.ZIP_STORED) as archive,  # recordings are compressed already
    ):
        for one in sessions:
            if one.recording:
                own = Path(scratch) / one.recording
                files.copy_of(store.recording(one), own, pseudonym, without=False)
                packed.append(Packed(name=one.recording, size=own.stat().st_size, sha256=_sum(own)))
                archive.write(own, one.recording)
                own.unlink()
        manifest = Manifest(version=VERSION, subject=subject, sessions=sessions, files=tuple(packed))
        archive.writestr(MANIFEST, msgspec.json.encode(manifest))
    return manifest


def unpack(store: Store, source: Path) -> Manifest:
    """Take a subject from a zip into the store. Raises StoreError for a zip that cannot be trusted, and for a
    subject or a recording that is there already; nothing is changed then."""
    try:
        with zipfile.ZipFile(source) as archive, TemporaryDirectory(dir=store.folder) as scratch:
            manifest = _manifest(archive, source)
            pseudonym = keys.subject_chunk(manifest.subject.pseudonym)
            if store.subject(pseudonym) is not None:
                raise StoreError(f"{pseudonym} is in {store.folder} already; delete it first")
            _check_names(archive, manifest, store.folder)
            for one in manifest.files:
                _extract(archive, one, Path(scratch) / one.name)
            for session in manifest.sessions:
                if session.recording:
                    _check_recording(Path(scratch) / session.recording, session)
            _take_in(store, manifest, Path(scratch))
    except (zipfile.BadZipFile, RuntimeError, EOFError) as error:  # RuntimeError: encrypted, or unknown
        raise StoreError(f"{source}: no zip that can be read ({error})") from None
    return manifest


def _take_in(store: Store, manifest: Manifest, scratch: Path) -> None:
    """Put what was checked into the store and its recordings beside it: all, or nothing."""
    moved: list[Path] = []
    try:
        with store.together():
            store.put_subject(manifest.subject)
            for one in manifest.files:
                moved.append((scratch / one.name).rename(store.folder / one.name))
            for session in manifest.sessions:
                store.add(session)
    except BaseException as error:
        for path in moved:
            path.unlink(missing_ok=True)
        if isinstance(error, OverflowError | sqlite3.IntegrityError):
            raise StoreError(f"{MANIFEST} holds a number that cannot be: {error}") from None
        raise


def _manifest(archive: zipfile.ZipFile, source: Path) -> Manifest:
    try:
        with archive.open(MANIFEST) as file:
            text = file.read(MANIFEST_BYTES + 1)
    except KeyError:
        raise StoreError(f"{source}: holds no {MANIFEST}; made by: brachium sessions export") from None
    if len(text) > MANIFEST_BYTES:
        raise StoreError(f"{source}: {MANIFEST} is larger than any subject's")
    try:
        manifest = msgspec.json.decode(text, type=Manifest)
    except (msgspec.DecodeError, UnicodeDecodeError) as error:
        raise StoreError(f"{source}: {MANIFEST} cannot be read: {error}") from None
    if manifest.version > VERSION:
        raise StoreError(f"{source}: written by a newer Brachium; update Brachium")
    return manifest


def _check_names(archive: zipfile.ZipFile, manifest: Manifest, folder: Path) -> None:
    """Raise unless the zip holds just what its manifest names, each once, with plain names that are free."""
    inside = sorted(archive.namelist())
    told = sorted([MANIFEST, *(one.name for one in manifest.files)])
    if inside != told:
        raise StoreError(
            f"the zip holds {len(inside)} files and its {MANIFEST} tells of {len(told)}, or others"
        )
    if any(one.compress_type != zipfile.ZIP_STORED for one in archive.infolist()):
        raise StoreError("the zip is compressed, which brachium sessions export never does")
    if {s.recording for s in manifest.sessions if s.recording} != {one.name for one in manifest.files}:
        raise StoreError("the zip's sessions and its recordings do not belong together")
    for one in manifest.files:
        if not one.name.endswith(".mcap"):
            raise StoreError(f"{one.name!r}: a recording's name ends in .mcap")
        try:
            keys.chunk(one.name.removesuffix(".mcap"), "recording")
        except keys.BadKey as error:
            raise StoreError(str(error)) from None
        if (folder / one.name).exists():
            raise StoreError(f"{one.name} is in {folder} already")
    for session in manifest.sessions:
        if session.subject != manifest.subject.pseudonym:
            raise StoreError(f"the zip of {manifest.subject.pseudonym} holds a session of {session.subject}")


def _extract(archive: zipfile.ZipFile, one: Packed, target: Path) -> None:
    """Write one file, no more of it than was told, and check its sum."""
    digest, left = hashlib.sha256(), one.size
    with archive.open(one.name) as source, target.open("xb") as file:
        while block := source.read(min(BLOCK, left + 1)):
            left -= len(block)
            if left < 0:
                raise StoreError(f"{one.name}: larger than the zip's {MANIFEST} tells")
            digest.update(block)
            file.write(block)
    if left or digest.hexdigest() != one.sha256:
        raise StoreError(f"{one.name}: damaged: its checksum differs")


def _check_recording(path: Path, session: SessionRecord) -> None:
    """Raise unless the recording is of this subject alone and of the origin that the session claims."""
    try:
        contents = load(path)
    except recording.RecordingError as error:
        raise StoreError(str(error)) from None
    others = {who for who, _ in (*contents.arms, *contents.sensors) if not files.is_of(session.subject, who)}
    if others:
        raise StoreError(f"{path.name}: holds {', '.join(sorted(others))}, too")
    if (found := origin(contents, session.subject)) != session.origin:
        raise StoreError(f"{path.name}: is {found}, and the zip calls it {session.origin}")


def _sum(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
