"""The text that stands beside each kind of message in a recording, made from messages.py itself."""

import ast
import inspect
from functools import cache

from msgspec.structs import fields

from brachium_wire import messages
from brachium_wire.sensor_records import SensorCalibration, SensorProgress

RECORDS = (SensorCalibration, SensorProgress, messages.SegmentPose)
"""What messages hold inside."""


@cache
def text(kind: type[messages.Message]) -> str:
    """Return what a message holds, for a reader with only the file: a line a field, `name: type  note`.

    The names are those in the MessagePack map; records inside follow below.
    """
    tag = kind.__struct_config__.tag
    wanted: list[type] = [kind]
    parts = [f"MessagePack map, m = {tag!r}. Fields may be absent; unknown ones are to be ignored."]
    for record in wanted:
        parts += ["", f"{record.__name__}: {' '.join((inspect.getdoc(record) or '').split())}"]
        notes = _notes(record)
        for f in fields(record):
            hint, note = notes.get(f.name, ("", ""))
            parts.append(f"  {f.encode_name}: {hint}" + (f"  {note}" if note else f"  {f.name}"))
            inner = [one for one in RECORDS if one.__name__ in hint]
            wanted += [one for one in inner if one not in wanted]
    return "\n".join(parts) + "\n"


@cache
def _notes(record: type) -> dict[str, tuple[str, str]]:
    """Return the type and the text below each field of a record."""
    found: dict[str, tuple[str, str]] = {}
    for node in ast.parse(inspect.getsource(record)).body:
        assert isinstance(node, ast.ClassDef)
        for statement, below in zip(node.body, [*node.body[1:], None], strict=True):
            if isinstance(statement, ast.AnnAssign) and isinstance(statement.target, ast.Name):
                note = ""
                if isinstance(below, ast.Expr) and isinstance(below.value, ast.Constant):
                    note = " ".join(str(below.value.value).split())
                found[statement.target.id] = (ast.unparse(statement.annotation), note)
    return found
