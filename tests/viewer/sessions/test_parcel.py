"""A subject as a zip: whole there and back, and nothing believed that was not checked."""

import json
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from brachium_viewer.sessions import parcel
from brachium_viewer.sessions.from_recording import session_from_recording
from brachium_viewer.sessions.records import StoreError, Subject
from brachium_viewer.sessions.store import Store


@pytest.fixture(scope="module")
def parcels(tmp_path_factory: pytest.TempPathFactory, script: Any, write_session: Any) -> Path:
    """Return a folder with a store of p01 and p02, who share a recording, and p01's zip."""
    folder = tmp_path_factory.mktemp("parcels")
    one, other = script("p01"), script("p02")
    for who in (one, other):
        who.set(2, 90.0)
    with Store.open(folder / "store") as store:
        write_session(folder / "store" / "a.mcap", [one, other])
        store.put_subject(Subject(pseudonym="p01", notes="left shoulder"))
        for who_is in ("p01", "p02"):
            store.add(session_from_recording(folder / "store" / "a.mcap", who_is))
        parcel.pack(store, "p01", folder / "p01.zip")
    return folder


def test_a_subject_goes_there_and_back_alone(parcels: Path, tmp_path: Path) -> None:
    with Store.open(parcels / "store") as store:
        before, subject = store.sessions("p01"), store.subject("p01")
    with Store.open(tmp_path / "new") as store:
        parcel.unpack(store, parcels / "p01.zip")
        after = store.sessions("p01")
        assert store.subject("p01") == subject
        assert [one.sets for one in after] == [one.sets for one in before]
        assert len(session_from_recording(store.recording(after[0])).sets) == 1
        for path in store.folder.iterdir():
            assert b"p02" not in path.read_bytes()
        with pytest.raises(StoreError, match="already"):
            parcel.unpack(store, parcels / "p01.zip")


def _name(manifest: dict[str, Any], entries: dict[str, bytes], name: str) -> None:
    """Give the recording another name, everywhere."""
    manifest["files"][0]["name"] = manifest["sessions"][0]["recording"] = name
    entries[name] = entries.pop("a.mcap")


def _shorter(manifest: dict[str, Any], _: dict[str, bytes]) -> None:
    manifest["files"][0]["size"] -= 1


def _flipped(_: dict[str, Any], entries: dict[str, bytes]) -> None:
    entries["a.mcap"] = entries["a.mcap"][:-20] + b"\0" + entries["a.mcap"][-19:]


def _other_origin(manifest: dict[str, Any], _: dict[str, bytes]) -> None:
    manifest["sessions"][0]["origin"] = "playback"


def _other_person(manifest: dict[str, Any], _: dict[str, bytes]) -> None:
    manifest["sessions"][0]["subject"] = "p09"


def _more(_: dict[str, Any], entries: dict[str, bytes]) -> None:
    entries["x.sh"] = b"#!/bin/sh"


def _newer(manifest: dict[str, Any], _: dict[str, bytes]) -> None:
    manifest["version"] += 1


def _too_late(manifest: dict[str, Any], _: dict[str, bytes]) -> None:
    manifest["sessions"][0]["started_ns"] = 2**70


def _worse_than_worst(manifest: dict[str, Any], _: dict[str, bytes]) -> None:
    rating = {"kind": "pain", "when": "after", "value": 11, "time_ns": 1}
    manifest["sessions"][0]["ratings"] = [rating]


HOSTILE: dict[str, tuple[Callable[[dict[str, Any], dict[str, bytes]], None], str]] = {
    "up and out": (lambda m, e: _name(m, e, "../a.mcap"), "cannot be used"),
    "absolute": (lambda m, e: _name(m, e, "/etc/a.mcap"), "cannot be used"),
    "the store itself": (lambda m, e: _name(m, e, "sessions.sqlite"), "ends in .mcap"),
    "larger than told": (_shorter, "larger than"),
    "damaged": (_flipped, "checksum"),
    "another origin": (_other_origin, "calls it playback"),
    "another person": (_other_person, "session of p09"),
    "one file more": (_more, "or others"),
    "a newer one": (_newer, "newer Brachium"),
    "a year that no file holds": (_too_late, "a number that cannot be"),
    "more pain than there is": (_worse_than_worst, "a number that cannot be"),
}


@pytest.mark.parametrize("trick", HOSTILE)
def test_a_hostile_zip_changes_nothing(parcels: Path, tmp_path: Path, trick: str) -> None:
    change, said = HOSTILE[trick]
    with zipfile.ZipFile(parcels / "p01.zip") as archive:
        entries = {name: archive.read(name) for name in archive.namelist()}
    manifest = json.loads(entries.pop(parcel.MANIFEST))
    change(manifest, entries)
    with zipfile.ZipFile(tmp_path / "x.zip", "w") as archive:
        for name, content in entries.items():
            archive.writestr(name, content)
        archive.writestr(parcel.MANIFEST, json.dumps(manifest))
    with Store.open(tmp_path / "new") as store:
        with pytest.raises(StoreError, match=said):
            parcel.unpack(store, tmp_path / "x.zip")
        assert store.subjects() == ()
    assert not [path.name for path in tmp_path.rglob("*") if path.suffix in (".mcap", ".sh")]


def test_a_compressed_zip_and_one_that_is_none_are_refused(parcels: Path, tmp_path: Path) -> None:
    with zipfile.ZipFile(parcels / "p01.zip") as archive:
        entries = {name: archive.read(name) for name in archive.namelist()}
    with zipfile.ZipFile(tmp_path / "x.zip", "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in entries.items():
            archive.writestr(name, content)
    (tmp_path / "y.zip").write_bytes(b"PK\3\4 and no more")
    with Store.open(tmp_path / "new") as store:
        with pytest.raises(StoreError, match="compressed"):
            parcel.unpack(store, tmp_path / "x.zip")
        with pytest.raises(StoreError, match="no zip"):
            parcel.unpack(store, tmp_path / "y.zip")
