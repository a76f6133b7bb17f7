"""How full a sensor's battery is, as the therapist's page says it: hours where a node tells them."""

import pytest

from brachium_wire import keys
from brachium_wire.bus import Bus
from brachium_wire.codec import encode
from brachium_wire.messages import Status

sync_api = pytest.importorskip("playwright.sync_api")

pytestmark = [pytest.mark.network, pytest.mark.browser]

PATIENCE_MS = 60_000


def test_a_sensor_that_tells_no_hours_is_shown_by_its_charge(browser, moving_arm, serve_pages, tmp_path):
    with (
        Bus.open(moving_arm) as bus,
        serve_pages(endpoint=moving_arm, sessions=tmp_path, open_door=True) as serving,
    ):

        def tell(**charge: float) -> None:
            status = Status(node="n", time_ns=1, connected=True, received=9, lost=0, out_of_order=0, **charge)
            bus.put(keys.status("lab", "p01", "forearm_r"), encode(status))

        page = browser.new_page(locale="en-GB")
        page.goto(serving.address)
        how = sync_api.expect(page.locator("#sensors .how"))
        how.to_have_text("silent", timeout=PATIENCE_MS)
        tell(battery_level=0.404)
        how.to_have_text("silent · battery 40 %", timeout=PATIENCE_MS)
        tell(battery_level=0.4, battery_hours=5.2)
        how.to_have_text("silent · 5 h", timeout=PATIENCE_MS)
        tell(battery_level=0.01, battery_hours=0.2)
        how.to_have_text("silent", timeout=PATIENCE_MS)
        page.close()
