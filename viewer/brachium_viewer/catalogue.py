"""What programs say in English, in another language: each sentence is its own key, `{names}` its figures.

One format for all that people read: web/words/de.json holds what pages and services say, report/words/de.json
what a report says beside it. The pages' own reader of it is web/pages/app/words.js.
"""

import json
import re
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import NamedTuple

from brachium_viewer.exercises import EXERCISES
from brachium_viewer.report import words

PAGES = Path(__file__).parent / "web" / "words"
REPORT = Path(__file__).parent / "report" / "words"
ENGLISH = "en"
LANGUAGES = (ENGLISH, *sorted(path.stem for path in REPORT.glob("*.json")))
"""What a report can be written in."""

_BLANK = re.compile(r"\{(\w+)\}")
_NUMBER = re.compile(r"[-+\N{MINUS SIGN}]?\d+(\.\d+)?")
_TIME = re.compile(r"(\d{4})-(\d\d)-(\d\d)(?: (\d\d:\d\d UTC))?")
"""A day, or one with hour and minute."""
_DOT = " \N{MIDDLE DOT} "
_LISTS = {", ": ", ", " and ": ", "}
_JOINTS = {"; ": "; ", ". ": ". "}
"""What stands between words and between sentences, and what stands there then."""
STRONG = 10
"""A sentence with so many letters of its own is known by them, whatever its blanks hold; one with fewer only
where they hold something known, or a name or figure that no word is like."""
_DATUM = re.compile(r"(?=.*[^a-z])\S+")


class _Made(NamedTuple):
    """A sentence with blanks."""

    pattern: re.Pattern[str]
    names: list[str]
    text: str


class Catalogue:
    """The sentences of one language by their English, and what segments and sides are called in it."""

    def __init__(self, sentences: dict[str, str], names: dict[str, str]) -> None:
        self._exact = {key: text for key, text in sentences.items() if not _BLANK.search(key)} | names
        # what says most of itself fits best
        made = sorted(sentences.keys() - self._exact.keys(), key=lambda k: (-_own(k), k))
        rows = [_Made(_pattern(key), _BLANK.findall(key), sentences[key]) for key in made]
        first_weak = sum(_own(key) >= STRONG for key in made)
        self._strong, self._weak = rows[:first_weak], rows[first_weak:]
        self._known: dict[str, str | None] = {}

    def told(self, text: str) -> str:
        """Return an English text in this language; what no line is for stays as it came."""
        if _DOT in text:
            return _DOT.join(self.told(part) for part in text.split(_DOT))
        return self._all_of(text) or self._joined(text, _JOINTS, self.told) or text

    def _all_of(self, value: str) -> str | None:
        """Return a text of which every part is known: a name, a figure, a sentence, or some of them."""
        if value not in self._known:
            self._known[value] = None  # nothing stands within itself
            self._known[value] = (
                self._word(value)
                or self._joined(value, _LISTS, self._all_of)
                or self._fits(self._strong, value)
                or self._fits(self._weak, value)
                or self._joined(value, _JOINTS, self._all_of)
            )
        return self._known[value]

    def _one(self, value: str) -> str | None:
        return self._word(value) or self._fits(self._strong, value) or self._fits(self._weak, value)

    def _word(self, value: str) -> str | None:
        if _NUMBER.fullmatch(value):
            return value.replace(".", ",")
        if found := _TIME.fullmatch(value):
            year, month, day, hour = found.groups()
            return f"{day}.{month}.{year}" + (f", {hour}" if hour else "")
        if value in self._exact:
            return self._exact[value]
        small = self._exact.get(value[:1].lower() + value[1:])
        return small and small[0].upper() + small[1:]

    def _fits(self, sentences: list[_Made], value: str) -> str | None:
        for pattern, names, text in sentences:
            found = pattern.fullmatch(value)
            if found is None:
                continue
            told = [self._all_of(part) for part in found.groups()]
            if all(k or self._as_it_is(p, sentences) for k, p in zip(told, found.groups(), strict=True)):
                values = {n: k or p for n, k, p in zip(names, told, found.groups(), strict=True)}
                return _BLANK.sub(lambda blank, values=values: values[blank[1]], text)  # type: ignore[misc]
        return None

    def _as_it_is(self, part: str, sentences: list[_Made]) -> bool:
        return ";" not in part if sentences is self._strong else _DATUM.fullmatch(part) is not None

    def _joined(self, text: str, marks: dict[str, str], rest: Callable[[str], str | None]) -> str | None:
        """Return a text that is known up to a mark, as far as can be, and whatever follows."""
        for mark, then in marks.items():
            kept = len(mark) - len(mark.lstrip("."))  # a sentence ends with its full stop
            at = text.rfind(mark)
            while at > 0:
                left = self._one(text[: at + kept])
                right = rest(text[at + len(mark) :]) if left else None
                if left and right:
                    return left + then[kept:] + right
                at = text.rfind(mark, 0, at)
        return None


def _own(key: str) -> int:
    return len(_BLANK.sub("", key))


def _pattern(key: str) -> re.Pattern[str]:
    return re.compile("(.+?)".join(map(re.escape, re.split(r"\{\w+\}", key))))


@cache
def catalogue(language: str) -> Catalogue:
    """Return the words of a report's language but English. Raises ValueError for one that is not there."""
    if language not in LANGUAGES[1:]:
        raise ValueError(f"there is no report in {language!r}; choose one of {', '.join(LANGUAGES)}")
    pages = json.loads((PAGES / f"{language}.json").read_text(encoding="utf-8"))
    sentences = {key: text for key, text in pages.items() if " " in key}
    sentences |= {words.exercise(name): pages[f"exercise.{name}"] for name in EXERCISES}
    sentences |= json.loads((REPORT / f"{language}.json").read_text(encoding="utf-8"))
    kinds = ("segment.", "side.")
    return Catalogue(
        sentences, {k.split(".")[1]: v for k, v in pages.items() if k.startswith(kinds) and k.count(".") == 1}
    )
