"""The catalogue of words: the same keys and gaps in every language, and none that is missing."""

import json
import re
from pathlib import Path

import brachium_viewer.web
from brachium_viewer.exercises import EXERCISES
from brachium_viewer.web.frames import ANGLES

WEB = Path(brachium_viewer.web.__file__).parent
ENGLISH, GERMAN = (
    json.loads((WEB / "words" / f"{language}.json").read_text("utf-8")) for language in ("en", "de")
)


def test_both_languages_have_the_same_words_and_gaps():
    assert ENGLISH.keys() == GERMAN.keys()
    for key, text in ENGLISH.items():
        assert text.strip()
        assert set(re.findall(r"{(\w+)}", text)) == set(re.findall(r"{(\w+)}", GERMAN[key])), key


def test_every_word_that_the_pages_name_is_there():
    named = set()
    for path in (*WEB.glob("pages/*.html"), *WEB.glob("pages/app/*.js")):
        text = path.read_text("utf-8")
        named |= set(re.findall(r'data-say(?:-label|-hint)?="([^"]+)"', text))
        named |= set(re.findall(r'\bsay\("([^"]+)"', text))
    assert sorted(key for key in named if key not in ENGLISH) == []


def test_every_exercise_angle_and_quality_has_its_words():
    wanted = [f"exercise.{name}{end}" for name in EXERCISES for end in ("", ".what")]
    wanted += [f"angle.{name}" for name in ANGLES]
    wanted += [
        f"quality.{name}"
        for name in ("good", "held", "missing", "disturbed", "uncalibrated", "heading_assumed", "assumed")
    ]
    assert [key for key in wanted if key not in ENGLISH] == []
