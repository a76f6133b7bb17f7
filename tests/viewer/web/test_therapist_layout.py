"""How the therapist's page stands on a tablet held across and at a desk, in the longer language."""

from collections.abc import Iterator
from typing import Any

import pytest

sync_api = pytest.importorskip("playwright.sync_api")

pytestmark = [pytest.mark.network, pytest.mark.browser]

PATIENCE_MS = 60_000
SHOWN = """() => {
  const put = (id, words) => {
    document.getElementById(id).hidden = false;
    document.getElementById(id).textContent = words;
  };
  put("headline", "6 von 6 Sensoren aktiv");
  put("recording", "Aufnahme 31:57");
  put("origin", "Emuliert: von niemandem getragen");
}"""


@pytest.fixture
def page(browser, serve_pages, moving_arm, tmp_path) -> Iterator[Any]:
    with serve_pages(endpoint=moving_arm, sessions=tmp_path, open_door=True) as serving:
        page = browser.new_context(locale="de-DE", viewport={"width": 1180, "height": 820}).new_page()
        page.goto(serving.address)
        sync_api.expect(page.locator("#subject-name")).to_have_text("p01", timeout=PATIENCE_MS)
        sync_api.expect(page.locator("#angle-value")).to_contain_text("°", timeout=PATIENCE_MS)
        yield page
        page.close()


def settled(page) -> None:
    """Let the page lay itself out: what watches a size has drawn anew two frames later."""
    page.evaluate("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")


def box(page, selector: str) -> dict[str, float]:
    found: dict[str, float] = page.locator(selector).bounding_box()
    return found


def bottom(page, selector: str) -> float:
    found = box(page, selector)
    return found["y"] + found["height"]


@pytest.mark.parametrize("size", [(1180, 820), (1100, 720), (1400, 900)])
def test_the_footer_lies_below_everything(page, size):
    page.set_viewport_size({"width": size[0], "height": size[1]})
    page.evaluate(SHOWN)
    settled(page)
    top = box(page, "footer p")["y"]
    for above in ("#course", "#panel", "#actions"):
        assert bottom(page, above) <= top + 1, above
    assert bottom(page, "#panel") <= box(page, "#actions")["y"]
    assert bottom(page, "#angle") <= box(page, "#course")["y"]


def test_what_is_said_under_start_moves_nothing(page):
    page.set_viewport_size({"width": 1400, "height": 900})
    settled(page)
    before = [box(page, one) for one in ("#stage", "#angle", "#course", "#start")]
    page.evaluate("document.getElementById('action-said').textContent = 'Satz beendet: 22 Wiederholungen.'")
    settled(page)
    assert [box(page, one) for one in ("#stage", "#angle", "#course", "#start")] == before


def test_the_gauge_is_as_wide_as_its_card_and_grows_with_the_letters(page):
    def legend() -> float:
        boxes = [text.bounding_box() for text in page.locator("#gauge text").all()]
        return max(float(one["height"]) for one in boxes)

    for width in (1400, 820, 390):
        page.set_viewport_size({"width": width, "height": 1000})
        settled(page)
        track = box(page, "#gauge .track")
        assert track["x"] == pytest.approx(box(page, "#angle-value")["x"], abs=3.0)
        assert track["x"] + track["width"] == pytest.approx(
            box(page, "#gauge")["x"] + box(page, "#gauge")["width"], abs=3.0
        )
        assert page.evaluate("document.querySelector('#gauge text').getScreenCTM().a") == pytest.approx(
            1.0, abs=0.02
        )
    for width in (1400, 820, 390, 320):
        page.set_viewport_size({"width": width, "height": 1000})
        settled(page)
        edge = box(page, "#gauge")["x"] + box(page, "#gauge")["width"]
        for text in page.locator("#gauge text").all():
            found = text.bounding_box()
            assert found["x"] + found["width"] <= edge + 2, (width, text.text_content())
        for tab in ("prepare", "exercise", "finish"):
            assert box(page, f"#tab-{tab}")["height"] < 60, (width, tab)  # in one line
    page.set_viewport_size({"width": 820, "height": 1000})
    settled(page)
    small = legend()
    page.evaluate("document.documentElement.style.fontSize = '200%'")
    settled(page)
    assert legend() == pytest.approx(2.0 * small, rel=0.15)
    edge = box(page, "#gauge")["x"] + box(page, "#gauge")["width"]
    for text in page.locator("#gauge text").all():
        found = text.bounding_box()
        assert found["x"] + found["width"] <= edge + 2, text.text_content()


def test_no_two_words_at_the_gauge_touch(page):
    touching = page.evaluate("""async () => {
        const { Gauge } = await import("/app/gauge.js");
        const { LANGUAGES, speak } = await import("/app/words.js");
        const found = [];
        const across = (a, b) => a.left < b.right && b.left < a.right;
        const touch = (a, b) => across(a, b) && a.top < b.bottom - 1 && b.top < a.bottom - 1;
        for (const language of LANGUAGES) {
            await speak(language);
            for (const wide of [300, 460]) {
                const box = document.createElement("div");
                box.id = "gauge";
                box.style.width = `${wide}px`;
                document.body.append(box);
                const gauge = new Gauge(box);
                gauge.fit();
                for (let limit = 5; limit <= 150; limit += 5) {
                    gauge.mean({ band: [0, 150], need: 130, goal: limit - 5, limit, rises: true });
                    const words = [...box.querySelectorAll("text")];
                    const places = words.map((one) => one.getBoundingClientRect());
                    for (let i = 0; i < words.length; i++) {
                        for (let j = 0; j < i; j++) {
                            const both = `${words[j].textContent} / ${words[i].textContent}`;
                            if (touch(places[i], places[j])) found.push(`${wide} px: ${both}`);
                        }
                    }
                }
                box.remove();
            }
        }
        return found;
    }""")
    assert touching == []
