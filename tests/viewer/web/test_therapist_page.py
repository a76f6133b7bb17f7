"""The therapist's page in a real Chromium: it shows, counts and warns, and asks nobody else for anything."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from brachium_wire.messages import Calibration

sync_api = pytest.importorskip("playwright.sync_api")

pytestmark = [pytest.mark.network, pytest.mark.browser]

PATIENCE_MS = 60_000


@pytest.fixture
def wearer(wear) -> Iterator[str]:
    """A router, and an arm that bends its elbow with three sensors on it; the router's endpoint."""
    done = Calibration(time_ns=1, state="done")
    with wear("upper_arm_r", "forearm_r", "hand_r", speed=3.0, calibration=done) as endpoint:
        yield endpoint


class Watched:
    """A page, and everything it complained of or asked of somebody else."""

    def __init__(self, page, own: str) -> None:
        self.page, self.complaints, self.elsewhere = page, [], []
        page.on("pageerror", lambda error: self.complaints.append(str(error)))
        page.on("console", lambda said: self.complaints.append(said.text) if said.type == "error" else None)
        page.on("request", lambda asked: None if own in asked.url else self.elsewhere.append(asked.url))

    def wait_for(self, identity: str, holds: str) -> None:
        sync_api.expect(self.page.locator(identity)).to_contain_text(holds, timeout=PATIENCE_MS)


def test_a_session_on_the_page(browser, serve_pages, wearer, tmp_path: Path):
    with serve_pages(endpoint=wearer, sessions=tmp_path) as serving:
        context = browser.new_context(viewport={"width": 1400, "height": 900}, locale="en-GB")
        context.set_default_timeout(PATIENCE_MS)
        watched = Watched(context.new_page(), serving.address.removeprefix("http://"))
        page = watched.page

        page.goto(f"{serving.address}/")
        page.fill("#word", serving.codes[0])
        page.click("#door button")
        watched.wait_for("#subject-name", "p01")
        watched.wait_for("#origin", "Emulated")
        watched.wait_for("#headline", "of 3 sensors")
        watched.wait_for("#angle-value", "°")
        watched.wait_for("#calibration-state", "Calibrated")

        page.click("#tab-exercise")
        page.check("#use-limit")
        page.fill("#plan-limit", "70")
        page.fill("#plan-repetitions", "2")
        page.click("#start")
        watched.wait_for("#recording", "Recording")
        watched.wait_for("#over-words", "70°")
        sync_api.expect(page.locator("#over")).to_be_visible(timeout=PATIENCE_MS)
        watched.wait_for("#count-said", "repetitions")
        page.click("#mark")
        watched.wait_for("#action-said", "Marked")
        page.click("#stop")
        watched.wait_for("#action-said", "Set ended")

        page.click("#language")
        watched.wait_for("#tab-finish", "Abschließen")
        page.click("#tab-finish")
        page.click("text=Sitzung beenden")
        watched.wait_for("#report-said", "Aufbewahrt")
        sync_api.expect(page.locator("#report-open")).to_be_visible(timeout=PATIENCE_MS)

        for width, height in ((1400, 900), (820, 1180), (390, 844)):
            page.set_viewport_size({"width": width, "height": height})
            assert page.evaluate("document.documentElement.scrollWidth") <= width
        context.close()
    assert watched.complaints == []
    assert watched.elsewhere == []
