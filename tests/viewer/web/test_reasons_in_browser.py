"""Sentences that services said in English, as a page shows them: the page's own code in a real Chromium."""

import json
import re

import pytest

from brachium_fusion.alignment_warnings import warnings_for
from brachium_viewer.catalogue import catalogue
from brachium_viewer.web.files import FOLDER, pages
from brachium_wire import keys
from brachium_wire.bus import Bus
from brachium_wire.codec import encode
from brachium_wire.messages import Calibration

sync_api = pytest.importorskip("playwright.sync_api")
pytestmark = pytest.mark.browser

BLANK = re.compile(r"\{(\w+)\}")
ADDRESS = "http://pages.test"


@pytest.fixture(scope="module")
def told(browser):
    """What a page in a language makes of texts."""
    files = pages()

    def serve(route):
        file = files.get(route.request.url.removeprefix(ADDRESS))
        if file is None:
            route.fulfill(body="<!doctype html>", content_type="text/html")
        else:
            route.fulfill(body=file.body, content_type=file.kind)

    page = browser.new_page()
    page.route("**/*", serve)
    page.goto(f"{ADDRESS}/nothing")

    def ask(language: str, texts: list[str | None]) -> list[str]:
        asked = """async ([language, texts]) => {
            const { speak, told } = await import("/app/words.js");
            await speak(language);
            return texts.map(told);
        }"""
        return page.evaluate(asked, [language, texts])

    return ask


def german() -> dict[str, str]:
    words = json.loads((FOLDER / "words" / "de.json").read_text("utf-8"))
    return {key: text for key, text in words.items() if " " in key}


def test_each_sentence_is_known_with_its_figures_to_pages_and_reports(told):
    filled = [dict(zip(BLANK.findall(key), "QRSTUV", strict=False)) for key in german()]
    texts = [key.format(**values) for key, values in zip(german(), filled, strict=True)]
    wanted = [text.format(**values) for text, values in zip(german().values(), filled, strict=True)]
    assert told("de", texts) == wanted
    assert [catalogue("de").told(text) for text in texts] == wanted


def test_blanks_are_said_in_the_language_too(told):
    (said,) = told(
        "de",
        ["forearm_r was not still for 3 s within 30 s; stand still (slower than 0.15 rad/s) and ask again"],
    )
    assert said.startswith("Rechter Unterarm war innerhalb von 30 s nie 3 s lang still")
    moved = "not still in the pose n-pose: forearm_r by 12 deg, hand_r by 8.5 deg; hold it for some seconds"
    (said,) = told("de", [moved])
    assert "Rechter Unterarm um 12°, Rechte Hand um 8,5°" in said
    (said,) = told("de", ["no skeletons of the left arm come: are its sensors on?"])
    assert "Arm (links)" in said


def test_reasons_that_were_joined_come_apart(told):
    bend = (
        "too little movement: the elbow bent by 5 deg, at least 30 are needed; bend and straighten it",
        "too little movement: the forearm turned by 3 deg, at least 20 are needed",
    )
    (said,) = told("de", ["; ".join(bend)])
    assert said == "; ".join(told("de", list(bend)))
    assert "Ellbogen beugte sich um 5°" in said
    assert "der Unterarm drehte sich um 3°" in said


def test_what_fusion_says_of_a_pose_is_german_throughout(told):
    segments = ("sternum", "upper_arm_r", "forearm_r")
    scores = {"from_nominal_deg_forearm_r": 92.4}
    english = warnings_for("none", segments, segments, [], scores)
    assert len(english) == 4
    for text in told("de", list(english)):
        assert not set(re.findall(r"\w+", text)) & {"the", "of", "is", "and", "forearm_r", "upper_arm_r"}, (
            text
        )


def test_no_reason_is_no_word(told):
    assert told("de", ["", None]) == ["", ""]


def test_english_is_as_it_came_but_for_the_names_of_parts(told):
    texts = ["upper_arm_l was not still", "something nobody wrote down: 3 s"]
    assert told("en", texts) == ["Left upper arm was not still", texts[1]]
    assert told("de", texts) == ["Linker Oberarm was not still", texts[1]]


@pytest.mark.network
def test_the_therapists_page_gives_fusions_reasons_in_german(browser, serve_pages, moving_arm, tmp_path):
    refused = (
        "forearm_r was not still for 3 s within 30 s; stand still (slower than 0.15 rad/s) and ask again"
    )
    few = "too little movement: the elbow bent by 5 deg, at least 30 are needed; bend and straighten it"
    (warning,) = warnings_for("elbow", ("forearm_r",), (), [], {"from_nominal_deg_forearm_r": 92.4})
    news = Calibration(
        time_ns=1, state="refused", reason=refused, refused={"elbow_r": few}, warnings=[warning]
    )
    with (
        Bus.open(moving_arm) as bus,
        serve_pages(endpoint=moving_arm, sessions=tmp_path, open_door=True) as serving,
    ):
        bus.retain(keys.calibration("lab", "p01"), encode(news))
        page = browser.new_context(locale="de-DE").new_page()
        page.goto(f"{serving.address}/")

        def holds(identity: str, text: str) -> None:
            sync_api.expect(page.locator(identity)).to_contain_text(text, timeout=60_000)

        holds("#calibration-state", "Rechter Unterarm war innerhalb von 30 s nie 3 s lang still")
        holds("#calibration-notes", "Der Ellbogen beugte sich um 5°, mindestens 30° sind nötig")
        holds("#calibration-notes", "oder der Arm war nicht in der Haltung")
        page.click("#zero")
        holds("#calibration-state", "Die Auswertung antwortet nicht")
        page.click("#language")
        holds("#calibration-notes", "or the arm was not in the pose")
        page.close()
