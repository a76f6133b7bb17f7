"""Subjects and their sessions, in one folder beside the recordings.

brachium sessions add p01-2026-09-21T14-13-20Z.mcap --dir recordings
  brachium sessions list --dir recordings
  brachium sessions export p01 --out p01.zip --dir recordings
"""

import argparse
import shutil
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from brachium.shell import Usage, add_json, count, print_json

if TYPE_CHECKING:
    from brachium_viewer.sessions.records import SessionRecord
    from brachium_viewer.sessions.store import Store


def configure(parser: argparse.ArgumentParser) -> None:
    """Add a command for each deed."""
    deeds = parser.add_subparsers(dest="deed", required=True, metavar="DEED")
    for name, text, argument in (
        ("list", "everybody and their sessions", None),
        ("show", "one session's sets", "SESSION"),
        ("add", "measure a recording and keep it as a session", "RECORDING"),
        ("export", "everything of a subject as one zip", "SUBJECT"),
        ("import", "a subject from such a zip", "ZIP"),
        ("delete", "everything of a subject: sessions, recordings, reports beside them", "SUBJECT"),
    ):
        deed = deeds.add_parser(name, help=text, description=f"{text[0].upper()}{text[1:]}.")
        if argument is not None:
            deed.add_argument("what", metavar=argument, type=int if name == "show" else str)
        if name == "add":
            deed.add_argument("--subject", help="which subject of the recording")
        if name == "export":
            deed.add_argument(
                "--out", type=Path, required=True, metavar="FILE", help="the zip, not there yet"
            )
        if name == "delete":
            deed.add_argument("--yes", action="store_true", help="do it: nothing brings it back")
        deed.add_argument("--dir", type=Path, default=Path("recordings"), help="the folder")
        add_json(deed)


def run(args: argparse.Namespace) -> int:
    """Do it, and say what was done."""
    from brachium_viewer.sessions.reading import open_to_read
    from brachium_viewer.sessions.store import Store

    if args.deed not in ("add", "import") and not args.dir.is_dir():
        raise Usage(f"--dir {args.dir}: there is no such folder")
    opened = open_to_read if args.deed in ("list", "show", "export") else Store.open
    with opened(args.dir) as store:
        found, text = _DEEDS[args.deed](store, args)
    if args.json:
        print_json(found)
    else:
        print(text)
    return 0


def _list(store: "Store", args: argparse.Namespace) -> tuple[Any, str]:  # noqa: ARG001 (as every deed)
    sessions = store.sessions()
    people = [one.pseudonym for one in store.subjects()]
    lines = [_line(one) for one in sessions]
    rows = [{"id": s.id, "subject": s.subject, "origin": s.origin, "started_ns": s.started_ns,
             "recording": s.recording, "sets": len(s.sets)} for s in sessions]  # fmt: skip
    text = (
        "\n".join([f"{count(len(people), 'subject')}: {', '.join(people)}", *lines])
        if people
        else "nobody yet"
    )
    return {"subjects": people, "sessions": rows}, text


def _show(store: "Store", args: argparse.Namespace) -> tuple[Any, str]:
    session = store.session(args.what)
    lines = [_line(session)]
    for one in session.sets:
        measures = one.measures
        best = measures.best_peak
        far = f"best {best.value:.0f} deg" if best.value is not None else f"withheld: {best.withheld}"
        lines.append(f"  {' '.join(one.what)}: {count(len(measures.repetitions), 'repetition')}, {far}")
    return session, "\n".join(lines)


def _add(store: "Store", args: argparse.Namespace) -> tuple[Any, str]:
    from brachium_viewer.sessions.from_recording import session_from_recording

    path = Path(args.what)
    session = session_from_recording(path, args.subject)
    target = store.folder / path.name
    if not target.exists():
        part = target.with_name(target.name + ".part")
        shutil.copyfile(path, part)
        part.replace(target)
    elif not target.samefile(path):
        raise Usage(f"{path.name}: another recording of that name is in {store.folder}; rename one of them")
    number = store.add(session)
    return {"session": number}, _line(store.session(number))


def _export(store: "Store", args: argparse.Namespace) -> tuple[Any, str]:
    from brachium_viewer.sessions import parcel

    packed = parcel.pack(store, args.what, args.out)
    sizes = {"sessions": len(packed.sessions), "recordings": len(packed.files)}
    said = f"{count(sizes['sessions'], 'session')}, {count(sizes['recordings'], 'recording')}"
    return sizes, f"{args.out}: {said}"


def _import(store: "Store", args: argparse.Namespace) -> tuple[Any, str]:
    from brachium_viewer.sessions import parcel

    found = parcel.unpack(store, Path(args.what))
    who = found.subject.pseudonym
    return {
        "subject": who,
        "sessions": len(found.sessions),
    }, f"{who}: {count(len(found.sessions), 'session')}"


def _delete(store: "Store", args: argparse.Namespace) -> tuple[Any, str]:
    if not args.yes:
        raise Usage(f"deleting {args.what} cannot be undone; export first, then say --yes")
    store.delete(args.what)
    return {"deleted": args.what}, f"{args.what}: deleted, with every recording"


_DEEDS = {
    "list": _list,
    "show": _show,
    "add": _add,
    "export": _export,
    "import": _import,
    "delete": _delete,
}


def _line(session: "SessionRecord") -> str:
    when = f"{datetime.fromtimestamp(session.started_ns / 1e9, UTC):%Y-%m-%d %H:%M} UTC"
    shown = "" if session.origin == "worn" else f"  {session.origin.upper()}, in no history"
    sets = count(len(session.sets), "set")
    return f"{session.id}  {session.subject}  {when}  {sets}  {session.recording}{shown}"
