"""A page whose server is gone shows no number of an arm, and does not claim to record."""

import threading

import pytest

sync_api = pytest.importorskip("playwright.sync_api")
PATIENCE_MS, LOOK_MS = 60_000, 50
NOTE = """() => {
    const angle = document.getElementById("angle-value");
    window.noted = [];
    const watch = new MutationObserver(() => window.noted.push(angle.textContent));
    watch.observe(angle, {childList: true, characterData: true, subtree: true});
}"""

pytestmark = [pytest.mark.network, pytest.mark.browser]


def test_a_page_that_is_cut_off_shows_no_number(browser, moving_arm, serve_pages, tmp_path):
    context = browser.new_context(locale="en-GB")
    context.set_default_timeout(PATIENCE_MS)
    page, patient = context.new_page(), context.new_page()
    with serve_pages(endpoint=moving_arm, sessions=tmp_path, open_door=True) as serving:
        for one, path in ((page, "/"), (patient, "/patient")):
            one.goto(serving.address + path)
        expect = sync_api.expect
        expect(page.locator("#angle-value")).to_contain_text("°", timeout=PATIENCE_MS)
        page.click("#start")
        expect(page.locator("#recording")).to_be_visible(timeout=PATIENCE_MS)
        expect(patient.locator("body")).to_contain_text("Move calmly", timeout=PATIENCE_MS)
    expect(page.locator("#angle-value")).to_have_text("–", timeout=PATIENCE_MS)
    expect(page.locator("#recording")).to_be_hidden()
    expect(page.locator("#count-value")).not_to_have_text("–")  # what was counted stays
    expect(patient.locator("body")).not_to_contain_text("Move calmly", timeout=PATIENCE_MS)
    context.close()


def test_a_line_that_is_dead_and_not_closed_is_noticed_and_made_anew(
    browser, moving_arm, serve_pages, tmp_path
):
    page = browser.new_page(locale="en-GB")
    lines = []

    def between(line) -> None:
        lines.append(dead := threading.Event())
        server = line.connect_to_server()
        server.on_message(lambda message: None if dead.is_set() else line.send(message))

    page.route_web_socket("**/ws", between)
    with serve_pages(endpoint=moving_arm, sessions=tmp_path, open_door=True) as serving:
        page.goto(serving.address)
        angle, headline = (sync_api.expect(page.locator(name)) for name in ("#angle-value", "#headline"))
        angle.to_contain_text("°", timeout=PATIENCE_MS)
        page.evaluate(NOTE)
        lines[0].set()
        for _ in range(PATIENCE_MS // LOOK_MS):
            if "–" in page.evaluate("window.noted"):  # for less than a second: a look alone may come too late
                break
            page.wait_for_timeout(LOOK_MS)
        else:
            raise AssertionError("a dead line's angle is still shown")
        angle.to_contain_text("°", timeout=PATIENCE_MS)
        headline.to_contain_text("of 1 sensors", timeout=PATIENCE_MS)
        page.close()
    assert len(lines) == 2
