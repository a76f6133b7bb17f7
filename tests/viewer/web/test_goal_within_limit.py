"""Whoever follows the goal never passes the limit: the page holds the goal back, and the server refuses."""

import pytest

from brachium_viewer.web.files import pages

ADDRESS = "http://pages.test"
BODY = """<!doctype html><div id="exercise"><select id="which"></select><p id="which-what"></p>
<div id="sides"></div><div id="modes"></div><div id="numbers"></div></div>"""


def test_a_goal_beyond_the_limit_is_refused(moving_arm, serve_pages, watch, tmp_path):
    async def asks(screen):
        await screen.until(lambda m: m["kind"] == "state" and m["sides"] == ["right"])

        async def begun(exercise: str, goal: float, limit: float) -> bool:
            words = {"exercise": exercise, "side": "right", "goal_deg": goal, "limit_deg": limit}
            answer = await screen.ask("exercise", **words)
            assert answer["ok"] or "beyond the limit" in answer["reason"]
            if answer["ok"]:
                await screen.ask("stop")
            return answer["ok"]

        assert not await begun("elbow-flexion", 120.0, 90.0)
        assert not await begun("elbow-extension", 10.0, 30.0)  # "not straighter than 30"
        assert await begun("elbow-flexion", 90.0, 90.0)
        assert await begun("elbow-extension", 40.0, 30.0)

    with serve_pages(endpoint=moving_arm, sessions=tmp_path, open_door=True) as page:
        watch(page.address, asks)


@pytest.mark.browser
def test_the_page_holds_the_goal_back(browser):
    files = pages()

    def serve(route):
        file = files.get(route.request.url.removeprefix(ADDRESS))
        body, kind = (BODY, "text/html") if file is None else (file.body, file.kind)
        route.fulfill(body=body, content_type=kind)

    page = browser.new_page()
    page.route("**/*", serve)
    page.goto(f"{ADDRESS}/nothing")
    page.evaluate("""async () => {
        const { Plan } = await import("/app/plan.js");
        window.plan = new Plan(() => {});
        plan.offer([
          { name: "elbow-flexion", rises: true, goal_deg: 120 },
          { name: "elbow-extension", rises: false, goal_deg: 10 },
        ]);
    }""")

    def goal() -> float:
        return page.evaluate("plan.words.goal_deg")

    assert goal() == 120
    page.check("#use-limit")
    assert page.input_value("#plan-limit") == "90"
    assert goal() == 90
    page.fill("#plan-goal", "140")
    page.press("#plan-goal", "Tab")
    assert goal() == 90
    page.fill("#plan-limit", "20")
    page.press("#plan-limit", "Tab")
    assert goal() == 20
    page.select_option("#which", "elbow-extension")  # its goal of 10 is straighter than 20
    assert goal() == 20
    page.close()
