"""Every text on both pages stands in one catalogue, in both languages, and nothing stands there unused."""

import json
import re
from html.parser import HTMLParser
from pathlib import Path

import pytest

from brachium_viewer.exercises import EXERCISES
from brachium_viewer.web.files import FOLDER

LANGUAGES = ("en", "de")
SCRIPTS = sorted((FOLDER / "pages").glob("*/*.js"))
PAGES = sorted((FOLDER / "pages").glob("*.html"))
QUOTED = re.compile(r"""["']([a-z][a-z0-9_.-]*)["']""")
MADE = re.compile(r"`([a-z0-9_.-]*(?:\$\{[^}`]*\}[a-z0-9_.-]*)+)`")
"""A key that is made of parts: `exercise.${name}.what`."""
OUR_NAME = "Brachium"
PRAISE = ("well done", "great", "good job", "improved", "super", "toll", "prima", "gut gemacht", "verbessert")


def words(language: str) -> dict[str, str]:
    """Return the words that pages have keys for; sentences that are their own key are test_reasons.py's."""
    found = json.loads((FOLDER / "words" / f"{language}.json").read_text("utf-8"))
    return {key: text for key, text in found.items() if " " not in key}


class Texts(HTMLParser):
    """The texts and keys of a page's own HTML: a text may stand only where a key replaces it."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.keys: set[str] = set()
        self.loose: list[str] = []
        self._open: list[dict[str, str | None]] = []
        self.feed(path.read_text("utf-8"))

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.handle_startendtag(tag, attrs)
        if tag not in ("meta", "link", "img", "input", "br"):  # those have no end
            self._open.append(dict(attrs))

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        del tag
        given = dict(attrs)
        self.keys |= {value for name, value in attrs if name.startswith("data-say") and value}
        for name in ("aria-label", "title", "placeholder"):
            self.loose += [str(given[name])] if given.get(name) else []

    def handle_endtag(self, tag: str) -> None:
        del tag
        self._open.pop()

    def handle_data(self, data: str) -> None:
        replaced = self._open and "data-say" in self._open[-1]
        if re.search(r"[^\W\d_]", data) and not replaced and data.strip() != OUR_NAME:
            self.loose.append(data.strip())


def used() -> tuple[set[str], list[re.Pattern[str]]]:
    """Return every key that a page or script names, and the shapes of keys that scripts make."""
    text = "\n".join(path.read_text("utf-8") for path in SCRIPTS)
    made = [key for key in MADE.findall(text) if "." in re.sub(r"\$\{[^}]*\}", "", key)]
    shapes = [
        re.compile(re.sub(r"\$\{[^}]*\}", "@", key).replace(".", r"\.").replace("@", ".+")) for key in made
    ]
    return set(QUOTED.findall(text)).union(*(Texts(path).keys for path in PAGES)), shapes


def test_both_languages_have_the_same_keys_and_the_same_blanks():
    english, german = (words(language) for language in LANGUAGES)
    assert list(english) == list(german)
    for key, text in english.items():
        blanks = re.compile(r"\{\w+\}")
        assert sorted(blanks.findall(text)) == sorted(blanks.findall(german[key])), key
        assert text.strip(), key
        assert german[key].strip(), key


def test_every_key_is_used():
    named, shapes = used()
    assert [k for k in words("en") if k not in named and not any(s.fullmatch(k) for s in shapes)] == []


def test_every_key_that_is_said_is_known():
    known = words("en")
    said = set().union(*(Texts(path).keys for path in PAGES))
    for path in SCRIPTS:
        said |= set(re.findall(r"""\bsay\(["']([^"']+)["']""", path.read_text("utf-8")))
    assert sorted(said - known.keys()) == []


@pytest.mark.parametrize("name", EXERCISES)
def test_each_exercise_has_its_words(name):
    for language in LANGUAGES:
        known = words(language)
        for key in (f"exercise.{name}", f"exercise.{name}.what", f"patient.exercise.{name}"):
            assert known[key], key


@pytest.mark.parametrize("path", PAGES, ids=lambda path: path.name)
def test_a_page_has_no_text_of_its_own(path):
    assert Texts(path).loose == []


def test_the_patient_is_told_no_degrees_and_given_no_praise():
    for language in LANGUAGES:
        for key, text in words(language).items():
            if key.startswith("patient."):
                assert "°" not in text, key
                assert not any(word in text.lower() for word in PRAISE), key


def test_one_repetition_has_words_of_its_own():
    counted = set()
    for path in SCRIPTS:
        counted |= set(re.findall(r"""\bsayCount\("([^"]+)\"""", path.read_text("utf-8")))
    assert counted == {"counted", "set.done"}
    for language in LANGUAGES:
        known = words(language)
        for key in counted:
            one, many = known[f"{key}.one"], known[key]
            assert one == many.replace("repetitions", "repetition").replace("ungen", "ung")
            assert one != many
