"""A phone held across, letters of any size: no button of the patient's page lies over what its head says."""

import itertools

import pytest

pytestmark = [pytest.mark.network, pytest.mark.browser]

PATIENCE_MS = 60_000
PHONES = ((844, 390), (667, 375))
SIZES = ("", "150", "200")
OVER = """([go, other]) => {
  const put = (id, text) => {
    document.getElementById(id).hidden = !text;
    document.getElementById(id).textContent = text;
  };
  put("go", go);
  put("other", other);
  const shown = (all) => [...document.querySelectorAll(all)].filter((e) => e.checkVisibility());
  const box = (e) => e.getBoundingClientRect();
  const name = (e) => `${e.id} "${e.textContent.trim()}"`;
  const faults = [];
  const heads = shown("header .notice:not(:empty), header button");
  const buttons = shown("footer button");
  for (const a of buttons) {
    const p = box(a);
    const beyond = p.bottom > innerHeight + 1 || p.right > innerWidth + 1 || p.left < -1;
    if (beyond) faults.push(`${name(a)} is cut`);
    if (p.top < -1) faults.push(`${name(a)} begins above`);
    if (p.width < 63.5 || p.height < 63.5) faults.push(`${name(a)} is small`);
    if (a.scrollWidth > a.clientWidth + 1) faults.push(`${name(a)} is wider than its box`);
    for (const b of [...heads, ...buttons]) {
      const q = box(b);
      if (a === b) continue;
      const across = Math.min(p.right, q.right) - Math.max(p.left, q.left);
      const down = Math.min(p.bottom, q.bottom) - Math.max(p.top, q.top);
      if (across > 1 && down > 1) faults.push(`${name(a)} lies over ${name(b)}`);
    }
  }
  return [heads.length > 2, faults];
}"""
DRESS = """async ([language, size, hand]) => {
  const words = await import("/app/words.js");
  await words.speak(language);
  document.documentElement.dataset.size = size;
  document.documentElement.dataset.hand = hand;
}"""


WORDS = (
    ("en", "Begin", ""),
    ("de", "Los geht’s", ""),
    ("en", "Next set (2 of 3)", "Another exercise"),
    ("de", "Nächster Satz (2 von 3)", "Noch eine Übung"),
)
"""One way on, or two: the longest that stand there together."""


def test_no_button_lies_over_the_badge(browser, moving_arm, serve_pages, tmp_path):
    with serve_pages(endpoint=moving_arm, sessions=tmp_path, open_door=True) as serving:
        page = browser.new_page()
        page.set_default_timeout(PATIENCE_MS)
        page.goto(serving.address + "/patient")
        page.wait_for_selector("#origin:visible")
        faults = []
        for phone, size, hand in itertools.product(PHONES, SIZES, ("right", "left")):
            page.set_viewport_size({"width": phone[0], "height": phone[1]})
            for language, *words in WORDS:
                page.evaluate(DRESS, [language, size, hand])
                badge, found = page.evaluate(OVER, words)
                assert badge
                faults += [f"{phone} {size} {hand} {words}: {one}" for one in found]
        page.close()
    assert faults == []
