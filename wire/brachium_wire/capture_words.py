"""What msgspec says of a capture.toml, in the words of the person who wrote it."""

import difflib
import re
from collections.abc import Mapping

_KINDS = {
    "str": "text",
    "float": "a number",
    "int": "a whole number",
    "bool": "true or false",
    "object": "a table",
    "array": "a list",
    "null": "nothing",
    "date": "a date",
    "datetime": "a date",
    "time": "a time of day",
}
_UNKNOWN = re.compile(r"Object contains unknown field `(.*?)`")
_CHOICE = re.compile(r"Invalid enum value '?(.*?)'?\Z")
_MISSING = re.compile(r"Object missing required field `(.*?)`")
_LENGTH = re.compile(r"Expected `array` of length (\d+), got (\d+)")
_KIND = re.compile(r"Expected `(.*?)`, got `(.*?)`")


def in_words(text: str, choices: Mapping[str, tuple[str, ...]], known: tuple[str, ...]) -> str:
    """Return a validation message as `entry: what was expected, what came`.

    choices: what each entry that is one of several words, or whose own entries are, may say. known: the
    names of all entries, for the nearest one to a misspelt one.
    """
    where = ""
    if " - at `" in text:
        text, _, where = text.partition(" - at `")
        where = re.sub(r"^(key` in `)?\$\.?", "", where.rstrip("`")).replace("[...]", "")
    text = _said(text, choices.get(where.rpartition(".")[2], ()), known)
    return f"{where}: {text}" if where else text


def nearest(name: str, names: tuple[str, ...]) -> str:
    """Return the end of a sentence on a name that is not known: the one meant, or all there are."""
    near = difflib.get_close_matches(name, names, n=1, cutoff=0.6)
    return f"; did you mean {near[0]!r}?" if near else f"; known are {', '.join(names)}"


def _said(text: str, choices: tuple[str, ...], known: tuple[str, ...]) -> str:
    if match := _UNKNOWN.search(text):
        return f"unknown entry {match[1]!r}{nearest(match[1], known)}"
    if match := _CHOICE.search(text):
        write = f"; write {', '.join(choices[:-1])} or {choices[-1]}" if choices else ""
        return f"{match[1]!r} is not known{write}"
    if match := _MISSING.search(text):
        return f"{match[1]} is missing"
    if match := _LENGTH.search(text):
        return f"expected {match[1]} numbers, came {match[2]}"
    if match := _KIND.search(text):
        expected = match[1].removesuffix(" | null")
        if choices and expected == "str":
            return f"expected {', '.join(choices[:-1])} or {choices[-1]}, came {_kind(match[2])}"
        return f"expected {_kind(expected)}, came {_kind(match[2])}"
    return text


def _kind(name: str) -> str:
    return _KINDS.get(name, name)
