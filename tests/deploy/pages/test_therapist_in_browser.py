"""The therapist's page in a real browser, on a desk, a tablet and a phone: from calibration to report."""

import pytest

pytestmark = [pytest.mark.network, pytest.mark.browser]

SIZES = {"desktop": (1400, 900), "tablet": (820, 1180), "phone": (390, 844)}
LOOKED_AT = {
    "desktop": ("prepare", "counting"),
    "tablet": ("exercise", "finish"),
    "phone": ("prepare", "exercise", "counting", "finish"),
}
"""What is judged in every dress; the phone is where it is narrowest."""
AXE_ON = "desktop", "tablet"
"""The structure that axe judges is the same on the phone."""


@pytest.mark.parametrize("device", SIZES)
def test_a_session_from_calibration_to_report(screen, network, device):
    with screen(SIZES[device], f"therapist-{device}", has_touch=device != "desktop") as one:
        page = one.page

        def looked(step: str) -> None:
            one.picture(step)
            if step in LOOKED_AT[device]:
                one.inspect(step, axe=device in AXE_ON)

        press = page.click if device == "desktop" else page.tap

        one.open("/")
        one.until(lambda: page.is_visible("#headline"))
        one.picture("nobody")
        with network.wearer():
            one.until(lambda: page.inner_text("#headline").startswith("3 "))
            press("#calibrate-pose")
            one.picture("calibrating")
            one.until(lambda: page.is_enabled("#calibrate-pose"))  # it is not while one is under way
            one.until(lambda: page.inner_text("#calibration-state").startswith("Calibrated"))
            looked("prepare")

            press("#tab-exercise")
            looked("exercise")
            press("#start")
            one.until(lambda: page.is_visible("#stop"))
            one.until(
                lambda: page.inner_text("#count-value").isdigit() and int(page.inner_text("#count-value")) > 1
            )
            one.arm("picture")
            looked("counting")
            press("#mark")
            press("#stop")
            one.until(lambda: page.is_visible("#start"))
            assert "emulated" in page.inner_text("#origin").lower()

            press("#tab-finish")
            looked("finish")
            press("#report")
            one.until(lambda: page.is_visible("#report-open"))
            one.picture("ended")
            with one.context.expect_page() as opened:
                press("#report-open")
            report = opened.value
            report.wait_for_load_state()
            assert "p01" in report.inner_text("body")
            one.keep(report, "report", full_page=True)
