"""What a therapist must know is said where the eye is: at Start, at the names, beside the recording."""

from collections.abc import Iterator
from typing import Any

import pytest

from brachium_wire import keys
from brachium_wire.bus import Bus
from brachium_wire.codec import encode
from brachium_wire.messages import Info

sync_api = pytest.importorskip("playwright.sync_api")

pytestmark = [pytest.mark.network, pytest.mark.browser]

PATIENCE_MS = 60_000


def holds(page: Any, identity: str, text: str) -> None:
    sync_api.expect(page.locator(identity)).to_contain_text(text, timeout=PATIENCE_MS)


@pytest.fixture
def page(browser, serve_pages, router_endpoint, tmp_path) -> Iterator[Any]:
    with serve_pages(endpoint=router_endpoint, sessions=tmp_path, open_door=True, subject="p01") as serving:
        page = browser.new_context(locale="en-GB", viewport={"width": 1400, "height": 900}).new_page()
        page.goto(serving.address)
        yield page
        page.close()


def test_that_nothing_will_be_counted_is_said_at_start(page, wear):
    hint = page.locator("#action-hint")
    with wear("forearm_r", assumed={"elbow_flexion": "uncalibrated"}):
        holds(page, "#action-hint", "Not calibrated: repetitions are not counted.")
        page.click("#start")
        holds(page, "#recording", "Recording")
        sync_api.expect(hint).to_be_visible()
        page.click("#language")
        holds(page, "#action-hint", "Nicht kalibriert: Wiederholungen werden nicht gezählt.")
    with wear("forearm_r"):
        sync_api.expect(hint).to_be_hidden(timeout=PATIENCE_MS)


def test_a_refusal_stands_at_the_names_and_an_empty_recording_says_that_it_is(page, wear):
    with wear("forearm_r") as endpoint, Bus.open(endpoint) as bus:
        other = Info(node="other", rate_hz=100.0, origin="emulated", host="h")
        bus.retain(keys.info("lab", "p02", "forearm_r"), encode(other))
        holds(page, "#angle-value", "°")
        page.click("#start")
        holds(page, "#recording", "Recording")
        page.click("#stop")
        page.click("#subject")
        page.locator("#subject-list button", has_text="p02").click()
        holds(page, "#subjects-said", "a session of p01 is recorded: end it first, under Finish")
        sync_api.expect(page.locator("#create-said")).to_have_text("")
        said, form = (page.locator(one).bounding_box()["y"] for one in ("#subjects-said", "#create"))
        assert said < form
        page.click("#subjects-close")
        sync_api.expect(page.locator("#recording")).not_to_contain_text("without data")
    holds(page, "#recording", "without data: no sensor is live")


def test_parts_that_fare_alike_are_called_so_once(page):
    holds(page, "#headline", "0 of 0 sensors")  # the page has its words
    named = page.evaluate("""async () => {
        const { showParts } = await import("/app/sensors.js");
        const arm = (...qualities) => ({
            stale: false,
            parts: { upper_arm: qualities[0], forearm: qualities[1], hand: qualities[2] },
        });
        const said = (arms) => {
            showParts(arms);
            return [...document.querySelectorAll("#parts li")].map((one) => one.textContent);
        };
        const none = arm("uncalibrated", "uncalibrated", "uncalibrated");
        return [said({ right: none, left: none }), said({ right: arm("good", "held", "held") })];
    }""")
    assert named == [["All parts: not calibrated"], ["Upper arm", "Forearm, Hand: held"]]


def test_that_a_goal_was_moved_is_in_sight_on_a_low_screen(page, wear):
    with wear("forearm_r"):
        holds(page, "#angle-value", "°")
        for size in ((1180, 820), (1100, 720), (820, 1180), (390, 844)):
            page.set_viewport_size({"width": size[0], "height": size[1]})
            page.click("#tab-exercise")
            if page.is_checked("#use-limit"):
                page.uncheck("#use-limit")
            page.fill("#plan-goal", "120")
            page.check("#use-limit")
            holds(page, "#plan-said", "Goal moved to 85°")
            said, panel, actions = (
                page.locator(one).bounding_box() for one in ("#plan-said", "#panel", "#actions")
            )
            assert said["y"] + said["height"] <= min(panel["y"] + panel["height"], actions["y"], size[1]), (
                size
            )
