"""A limit that was set is on every screen, however it is loaded, until somebody takes it away."""

import pytest

from brachium_wire.messages import Calibration

sync_api = pytest.importorskip("playwright.sync_api")

pytestmark = [pytest.mark.network, pytest.mark.browser]

PATIENCE_MS = 60_000


def holds(page, identity: str, text: str) -> None:
    sync_api.expect(page.locator(identity)).to_have_text(text, timeout=PATIENCE_MS)


def planned(page, **values: object) -> None:
    """Wait until the form shows a plan."""
    for name, value in values.items():
        if value is None:
            sync_api.expect(page.locator(f"#use-{name}")).not_to_be_checked(timeout=PATIENCE_MS)
        else:
            sync_api.expect(page.locator(f"#plan-{name}")).to_have_value(str(value), timeout=PATIENCE_MS)
            if name in ("goal", "limit"):
                sync_api.expect(page.locator(f"#use-{name}")).to_be_checked(timeout=PATIENCE_MS)


def test_a_limit_outlives_reloads_joins_and_sets_begun_elsewhere(browser, serve_pages, wear, tmp_path):
    done = Calibration(time_ns=1, state="done")
    with (
        wear("upper_arm_r", "forearm_r", "hand_r", speed=3.0, calibration=done) as endpoint,
        serve_pages(endpoint=endpoint, sessions=tmp_path, open_door=True) as serving,
    ):
        context = browser.new_context(locale="en-GB", viewport={"width": 1400, "height": 900})
        context.set_default_timeout(PATIENCE_MS)
        one = context.new_page()
        one.goto(serving.address)
        holds(one, "#subject-name", "p01")
        one.click("#tab-exercise")
        one.check("#use-limit")
        other = context.new_page()  # joins before any set was begun
        other.goto(serving.address)
        planned(other, limit=90, goal=85)
        holds(one, "#plan-said", "Goal moved to 85°: 5° before the limit, where the alarm sounds.")
        one.fill("#plan-limit", "92")  # no multiple of the buttons' step
        one.press("#plan-limit", "Tab")
        planned(one, limit=92, goal=85)

        planned(other, limit=92, goal=85)
        one.reload()
        planned(one, limit=92, goal=85)

        other.click("#tab-exercise")
        other.click("#start")
        holds(other, "#count-set", "Set 1 of 3")
        holds(one, "#count-set", "Set 1 of 3")
        one.reload()
        sync_api.expect(one.locator("#tab-exercise")).to_have_attribute("aria-selected", "true")
        planned(one, limit=92, goal=85)
        sync_api.expect(one.locator("#over")).to_be_visible(timeout=PATIENCE_MS)
        one.click("#stop")
        for page in (one, other):
            holds(page, "#start", "Start set 2 of 3")

        one.select_option("#which", "elbow-extension")
        one.uncheck("#use-limit")
        planned(other, limit=None)
        other.click("#tab-exercise")
        other.select_option("#which", "elbow-flexion")
        planned(one, limit=92, goal=85)
        holds(one, "#start", "Start set 2 of 3")
        context.close()
