"""Whoever follows the goal never passes the limit: the page holds the goal back, and the server refuses."""

import pytest

from brachium_viewer.web.files import pages

ADDRESS = "http://pages.test"
BODY = """<!doctype html><div id="exercise"><select id="which"></select><p id="which-what"></p>
<div id="sides"></div><div id="modes"></div><div id="numbers"></div><p id="plan-said"></p></div>"""


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


@pytest.fixture
def page(browser):
    """The form alone, its words as keys, and every plan that it told; `up` is the line."""
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
        window.told = [];
        window.up = true;
        const ask = async (verb, words) => {
            if (up) told.push({ verb, ...words });
            return { ok: up, reason: "" };
        };
        window.plan = new Plan(() => {}, { ask });
        plan.offer([
          { name: "elbow-flexion", rises: true, goal_deg: 120 },
          { name: "elbow-extension", rises: false, goal_deg: 10 },
        ]);
        plan.sides(["right", "left"]);
    }""")
    yield page
    page.close()


def typed(page, name: str, value: str) -> None:
    page.fill(f"#plan-{name}", value)
    page.press(f"#plan-{name}", "Tab")


@pytest.mark.browser
def test_the_page_holds_the_goal_some_degrees_before_the_limit_and_says_so(page):
    def goal() -> float:
        return page.evaluate("plan.words.goal_deg")

    assert goal() == 120
    page.check("#use-limit")
    assert page.input_value("#plan-limit") == "90"
    assert goal() == 85
    assert page.text_content("#plan-said") == "goal.moved"
    typed(page, "goal", "80")
    assert page.text_content("#plan-said") == ""
    typed(page, "goal", "140")
    assert goal() == 85
    typed(page, "limit", "20")
    assert goal() == 15
    page.select_option("#which", "elbow-extension")  # its goal of 10 is straighter than 20
    assert goal() == 25


@pytest.mark.browser
@pytest.mark.parametrize(
    ("text", "limit"), [("92", 92), ("91.5", 91.5), ("500", 180), ("-500", -180), ("", 90)]
)
def test_whatever_is_typed_a_limit_stays_a_limit(page, text, limit):
    page.check("#use-limit")
    typed(page, "limit", text)
    assert page.evaluate("[plan.words.limit_deg, Number(document.getElementById('plan-limit').value)]") == [
        limit,
        limit,
    ]


@pytest.mark.browser
def test_what_was_chosen_comes_through_a_cut_line_and_a_server_that_forgot(page):
    adopt = "plans => plan.adopt({ subject: 'p01', plans })"
    page.evaluate(adopt, [])
    assert page.evaluate("told") == []  # nobody chose anything yet
    page.evaluate("up = false")
    page.check("#use-limit")
    stale = page.evaluate("({ ...plan.words, limit_deg: null, set: 2 })")
    page.evaluate("up = true")
    page.evaluate(adopt, [stale])
    assert page.evaluate("told.map((one) => one.limit_deg)") == [90]
    assert page.evaluate("[plan.words.limit_deg, plan.number]") == [90, 2]
    kept = page.evaluate("({ ...plan.words, set: 2 })")
    page.evaluate(adopt, [kept])
    page.evaluate(adopt, [])  # started anew
    assert page.evaluate("told.map((one) => [one.limit_deg, one.set])") == [[90, 2], [90, 2]]
    page.evaluate("plan.adopt({ subject: 'p02', plans: [] })")
    assert page.evaluate("[plan.words.limit_deg, plan.words.goal_deg, plan.number]") == [None, 120, 1]
    page.evaluate(adopt, [])
    assert page.evaluate("[plan.words.limit_deg, plan.number]") == [90, 2]


@pytest.mark.browser
def test_who_trains_alone_has_the_limit_that_was_set_for_this_arm(page):
    page.check("#use-limit")
    found = page.evaluate("""async () => {
        const { planned } = await import("/patient/steps.js");
        const plans = [{ ...plan.words, set: 2 }];
        const flexion = { name: "elbow-flexion", goal_deg: 120 };
        const all = ["right", "left"].map((side) => planned(plans, flexion, side));
        return all.map((one) => [one.side, one.goal_deg, one.limit_deg, one.set, one.sets]);
    }""")
    assert found == [["right", 85, 90, 2, 3], ["left", 120, None, 1, 1]]
