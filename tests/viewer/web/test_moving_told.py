"""A pose that a calibration waits for: who moves is told while it waits, to therapist and patient."""

import pytest

from brachium_wire import keys
from brachium_wire.bus import Bus
from brachium_wire.codec import encode
from brachium_wire.messages import Answer, Calibration

sync_api = pytest.importorskip("playwright.sync_api")

pytestmark = [pytest.mark.network, pytest.mark.browser]

PATIENCE_MS = 60_000


def news(*moving: str) -> bytes:
    """What fusion tells of a pose that was asked for."""
    moved = list(moving)
    return encode(
        Calibration(time_ns=1, state="waiting", pose="n-pose", motion="n-pose", reason="x", moving=moved)
    )


def test_who_moves_is_told_while_a_pose_is_waited_for(browser, moving_arm, serve_pages, tmp_path):
    calibration = keys.calibration("lab", "p01")
    with (
        Bus.open(moving_arm) as bus,
        serve_pages(endpoint=moving_arm, sessions=tmp_path, open_door=True) as serving,
    ):
        replies = []

        def wait(*asked) -> None:
            replies.append(asked[-1])
            bus.retain(calibration, news("forearm_r", "hand_r"))

        bus.serve_later(keys.command("lab", "p01", "calibrate"), wait)
        page = browser.new_page(locale="en-GB")
        page.set_default_timeout(PATIENCE_MS)
        page.goto(serving.address)
        prompt = sync_api.expect(page.locator("#prompt-words"))
        sync_api.expect(page.locator("#subject-name")).to_have_text("p01", timeout=PATIENCE_MS)
        page.click("#calibrate-guided")
        still = "Stand or sit still. Arms hang down, palms at the thighs."
        who = "Not still yet: Right forearm, Right hand."
        prompt.to_have_text(f"{still} {who}", timeout=PATIENCE_MS)
        bus.retain(calibration, news())
        prompt.to_have_text(still, timeout=PATIENCE_MS)
        replies.pop()(encode(Answer(ok=False, reason="forearm_r was not still")))
        said = sync_api.expect(page.locator("#calibration-state"))
        said.to_have_text("Right forearm was not still", timeout=PATIENCE_MS)
        bus.retain(calibration, encode(Calibration(time_ns=1, state="done")))  # asked for elsewhere
        said.to_contain_text("Calibrated.", timeout=PATIENCE_MS)
        page.close()


def test_the_patient_is_told_what_still_moves(browser, moving_arm, serve_pages, tmp_path):
    with serve_pages(endpoint=moving_arm, sessions=tmp_path, open_door=True) as serving:
        page = browser.new_page(locale="de-DE")
        page.goto(f"{serving.address}/patient")
        page.wait_for_selector("#origin:visible")
        said = page.evaluate("""async () => {
            const { Screens } = await import("/patient/screens.js");
            const of = (moving) => ({ calibration: { state: "waiting", progress: 0, moving } });
            const screens = new Screens({}, { busy: true, refused: "" });
            return [["upper_arm_r", "upper_arm_l", "hand_r"], []].map((moving) => {
              screens.room.state = of(moving);
              screens.still(of(moving));
              return document.getElementById("still-what").textContent;
            });
        }""")
        page.close()
    assert said == [
        "Bitte still bleiben. Es bewegt sich noch: Oberarm, Hand.",
        "Bitte still bleiben.",
    ]
