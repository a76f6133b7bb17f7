"""Who is drawn has two arms, whatever is measured of them, and stands in the middle of the mirror."""

from collections.abc import Iterator
from typing import Any

import pytest

from brachium_viewer.web.files import pages

pytestmark = pytest.mark.browser

ADDRESS = "http://pages.test"
ARM = {
    "stale": False,
    "trunk": [1, 0, 0, 0],
    "positions": {
        "shoulder": [0.19, 0, 0],
        "elbow": [0.5, 0, 0],
        "wrist": [0.76, 0, 0],
        "hand": [0.94, 0, 0],
    },
    "parts": {"upper_arm": "good", "forearm": "good", "hand": "good"},
}


@pytest.fixture
def drawing(browser) -> Iterator[Any]:
    """A page with the figure alone, and its mirror in a box as on a phone."""
    files = pages()

    def serve(route):
        file = files.get(route.request.url.removeprefix(ADDRESS))
        body = '<!doctype html><div id="mirror" style="position:relative;width:358px;height:418px"></div>'
        route.fulfill(
            body=body if file is None else file.body, content_type="text/html" if file is None else file.kind
        )

    page = browser.new_page()
    page.route("**/*", serve)
    page.goto(f"{ADDRESS}/nothing")
    page.evaluate("""async () => {
        const { Figure } = await import("/app/figure.js");
        const { Scene } = await import("/vendor/three/three.module.js");
        const { Mirror } = await import("/patient/mirror.js");
        window.figure = new Figure(new Scene());
        window.mirror = new Mirror(document.getElementById("mirror"));
    }""")
    yield page
    page.close()


def test_an_arm_of_which_nothing_is_known_hangs_in_the_bodys_colour(drawing):
    look = """([arms]) => {
        figure.show(arms, null);
        const colour = (one) => one.limb.surface.uniforms.colour.value.getHex();
        const body = figure.body.uniforms.colour.value.getHex();
        const all = Object.entries(figure.arms);
        const pale = (arm) => arm.limbs.every((one) => colour(one) === body);
        const grey = Object.fromEntries(all.map(([side, arm]) => [side, pale(arm)]));
        return [figure.drawn(), grey];
    }"""
    for arms, grey in (
        ({}, {"right": True, "left": True}),
        ({"right": ARM}, {"right": False, "left": True}),
        ({}, {"right": True, "left": True}),
    ):
        drawn, found = drawing.evaluate(look, [arms])
        assert found == grey
        for side, sign in (("right", 1), ("left", -1)):
            assert list(drawn[side]) == ["upper_arm", "forearm", "hand"]
            (shoulder, _), (_, hand) = drawn[side]["upper_arm"], drawn[side]["hand"]
            assert sign * shoulder[0] == pytest.approx(0.19, abs=1e-6)
            if grey[side]:
                assert shoulder[2] - hand[2] > 0.6
    drawing.evaluate("figure.dress(true)")
    assert drawing.evaluate(look, [{}])[1] == {"right": True, "left": True}


def test_the_mirror_shows_the_whole_person_in_its_middle(drawing):
    for side, sign in (("right", 1), ("left", -1)):
        arm = {**ARM, "positions": {name: [sign * x, y, z] for name, (x, y, z) in ARM["positions"].items()}}
        at = drawing.evaluate(
            """([side, arm]) => {
                mirror.show(side, arm, false);
                mirror.camera.updateMatrixWorld();
                const at = (x) => mirror.camera.position.clone().set(-x, 0, 1.38).project(mirror.camera);
                return [0, 0.94, -0.94].map((x) => at(x).x);
            }""",
            [side, arm],
        )
        assert at[0] == pytest.approx(0.0, abs=1e-6)
        assert max(map(abs, at)) < 1.0
        assert at[1] > 0  # as in a mirror: the right arm at the right
