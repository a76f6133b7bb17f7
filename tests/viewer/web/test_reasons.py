"""Every reason that a page may show has its line in every language but English, and no line is left over."""

import json
from pathlib import Path

import pytest

import brachium_fusion
import brachium_viewer
import brachium_wire
from brachium_body.segments import SEGMENTS
from brachium_fusion.wear_words import place
from brachium_viewer.web.files import FOLDER

FUSION, VIEWER, WIRE = (Path(p.__file__).parent for p in (brachium_fusion, brachium_viewer, brachium_wire))
LANGUAGES = sorted(path.stem for path in (FOLDER / "words").glob("*.json") if path.stem != "en")

TERMINAL = {
    "of `solve` and `compare`": "best best_arm field_wander joint_axes joint_model result_quality "
    "shoulder_model shoulder_smoother shoulder_window slip_joints solve solve_table solve_terms uniform zhou "
    "zhou_cycles zhou_recording zhou_strapdown",
    "of `calibrate --sensor`": "magnetometer_calibration sensor_calibration sensor_desk sensor_fits "
    "sensor_guide sensor_steps turn_step",
    "of arguments that no page sends": "calibration_wish pipeline pose",
    "of an estimate that no page names": "shoulder_filter shoulder_watch",
}
"""Fusion's modules whose sentences reach no page. Whatever is new is not among them."""
PAGES = [
    *(FUSION / f"{path.stem}.py" for path in sorted(FUSION.glob("*.py"))),
    *(
        VIEWER / "web" / f"{name}.py"
        for name in ("desk", "keeping", "page_state", "requests", "session_desk")
    ),
    VIEWER / "recorder.py",
    WIRE / "keys.py",
]
"""Who gives reasons that a page shows."""
ELSEWHERE = {
    "expected records of one length, got {} rows",
    "expected a rate above 0, got {} Hz",
    "the span {} has rows {} to {}; records have {} rows",  # of arrays given to a function
    "wear-check does not know {}; it takes side",
    "wear-check: side is right, left or both, not {}",  # of arguments that no page sends
    "{}: what it felt fits no segment; look how it is worn and repeat the check",
    "is on the {}",
    "move it to the {}",
    "swap it with {}",
    "worn as it should be",
    "is upside down: turn it round on the skin, so that its y arrow points to the shoulder",
    "has its back to the outside: put it on with the other face to the skin",
    "is upside down and has its back to the outside: turn it over end to end",
    "sends orientations only; the check needs angular rates and accelerations",
    "is silent: switch it on, or look at its radio (brachium monitor)",
    "sends {} samples a second; the check needs {}",  # pages say what a check found in words of their own
    "key expression {} cannot be used: expected text of at most 1024 characters",
    "part of a key expression",
    "key {} is not of the form {}/<room>/<subject>/<topic>",
    "key {} names no topic of the table in docs/wire.md",
    "key part",
    "service kind",
    "service id",  # of keys that no page types
    "version {}, expected {}",  # of a file that is read before there is a page
}
"""Sentences of those modules that reach no page."""
MADE = {
    *(place(segment) for segment in SEGMENTS if place(segment) != segment),
    "No space left on device",
    "[Errno 28] No space left on device",
    "[Errno 28] No space left on device: {}",
}
"""Put together in code, or said by the system."""


def lines(language: str) -> dict[str, str]:
    words = json.loads((FOLDER / "words" / f"{language}.json").read_text("utf-8"))
    return {key: text for key, text in words.items() if " " in key}


@pytest.fixture(scope="module")
def said(texts_in) -> set[str]:
    aside = {name for names in TERMINAL.values() for name in names.split()}
    return {text for path in PAGES if path.stem not in aside for text in texts_in(path)}


@pytest.mark.parametrize("language", LANGUAGES)
def test_each_sentence_has_its_line_and_no_line_is_of_what_nobody_says(check_lines, said, language):
    check_lines(lines(language), said, ELSEWHERE, MADE)


def test_what_is_left_out_is_there():
    modules = {path.stem for path in FUSION.glob("*.py")}
    assert {name for names in TERMINAL.values() for name in names.split()} <= modules
