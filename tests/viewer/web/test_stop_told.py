"""What the therapist's page says of a patient's stop before and after its reason is chosen."""

import pytest

sync_api = pytest.importorskip("playwright.sync_api")

pytestmark = [pytest.mark.network, pytest.mark.browser]

PATIENCE_MS = 60_000


def test_until_a_reason_is_chosen_only_the_stop_is_told(browser, moving_arm, serve_pages, tmp_path):
    with serve_pages(endpoint=moving_arm, sessions=tmp_path, open_door=True) as serving:
        page, patient = browser.new_page(locale="en-GB"), browser.new_page(locale="en-GB")
        for one, path in ((page, "/"), (patient, "/patient")):
            one.set_default_timeout(PATIENCE_MS)
            one.goto(serving.address + path)
        said = sync_api.expect(page.locator("#alarm p"))
        patient.wait_for_selector("#origin:visible")
        patient.click("#stop")
        said.to_have_text("The patient has stopped", timeout=PATIENCE_MS)
        patient.click("[data-reason=dizzy]")
        said.to_have_text("The patient has stopped: Dizzy", timeout=PATIENCE_MS)
        page.close()
        patient.close()
