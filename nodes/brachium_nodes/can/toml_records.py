"""A TOML table as a record; what is wrong is told by the table, the field, and what may stand there."""

import tomllib
from pathlib import Path
from types import NoneType, UnionType
from typing import Any, Literal, TypeVar, Union, get_args, get_origin

import msgspec

T = TypeVar("T", bound=msgspec.Struct)


class BadMap(ValueError):
    """A map, a table or a DBC says something that cannot be; the text says what to write."""


def read_toml(path: Path, kind: type[T]) -> T:
    """Return a TOML file as a record. Raises BadMap, FileNotFoundError."""
    try:
        tables = tomllib.loads(path.read_text("utf-8"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise BadMap(f"{path} cannot be read as TOML: {error}") from None
    return _record(tables, kind, f"{path}: ")


def _record(table: Any, kind: type[T], where: str) -> T:
    if not isinstance(table, dict):
        raise BadMap(f"{where}must be a table; came {table!r}")
    fields = {field.name: field for field in msgspec.structs.fields(kind)}
    for name in table:
        if name not in fields:
            raise BadMap(f"{where}{name} is not known; choose of {', '.join(fields)}")
    for name, field in fields.items():
        if field.required and name not in table:
            raise BadMap(f"{where}{name} is missing; write {_takes(field.type)}")
    return kind(**{name: _value(value, fields[name].type, where, name) for name, value in table.items()})


def _value(value: Any, kind: Any, where: str, name: str) -> Any:
    inner = _record_of(kind)
    if inner is None:
        try:
            return msgspec.convert(value, kind)
        except msgspec.ValidationError:
            raise BadMap(f"{where}{name} {value!r} cannot be used; write {_takes(kind)}") from None
    if get_origin(kind) is list:
        if not isinstance(value, list):
            raise BadMap(f"{where}write a table [[{name}]] for each")
        return [_record(one, inner, f"{where}{name} {_called(one, k)}: ") for k, one in enumerate(value, 1)]
    if get_origin(kind) is dict:
        if not isinstance(value, dict):
            raise BadMap(f"{where}write a table [{name}.NAME] for each")
        return {key: _record(one, inner, f"{where}{name} {key}: ") for key, one in value.items()}
    return _record(value, inner, f"{where}{name}: ")


def _record_of(kind: Any) -> Any:
    """Return the record that a field is, may be, or holds many of; None for a plain value."""
    found = [
        one for one in (kind, *get_args(kind)) if isinstance(one, type) and issubclass(one, msgspec.Struct)
    ]
    return found[0] if found else None


def _called(table: Any, number: int) -> str:
    named = table.get("id") if isinstance(table, dict) else None
    return named if isinstance(named, str) else str(number)


def _takes(kind: Any) -> str:
    """Return what may stand in a field, for a person."""
    origin, inner = get_origin(kind), get_args(kind)
    if origin in (Union, UnionType):
        return _takes(next(one for one in inner if one is not NoneType))
    if origin is Literal:
        return " or ".join(f'"{one}"' if isinstance(one, str) else str(one) for one in sorted(inner))
    if origin is list:
        return 'texts in brackets, as ["a", "b"]'
    if origin is tuple:
        return f"{len(inner)} numbers in brackets, as [{', '.join(['1', *['0'] * (len(inner) - 1)])}]"
    if origin is dict:
        return 'names in braces, as { Message = "Signal" }'
    return _WORDS.get(kind, "a table")


_WORDS = {str: "a text in quotes", float: "a number", int: "a whole number", bool: "true or false"}
