"""The patient's whole way in a real browser, with touch alone: seen, measured, judged for who sees badly."""

import pytest

pytestmark = [pytest.mark.network, pytest.mark.browser]

PHONE = (390, 844)
TARGET_PX = 64


def test_the_patient_goes_the_whole_way_with_touch_alone(screen, network):
    with screen(PHONE, "patient-phone", own_letters=True, has_touch=True, is_mobile=True) as one:
        page = one.page

        def at(step: str) -> None:
            one.until(lambda: page.get_attribute("body", "data-step") == step)

        def looked(step: str, *, axe: bool = True) -> None:
            one.picture(step)
            one.inspect(step, target_px=TARGET_PX, axe=axe)

        one.open("/patient")
        at("begin")
        one.until(lambda: page.is_enabled("#go"))
        looked("begin")
        page.tap("#go")
        at("sensors")
        assert page.is_disabled("#go"), "nobody goes on without sensors"
        assert "No sensor" in page.inner_text("#worn-what")
        one.picture("sensors-silent")
        page.tap("#choose")
        looked("settings")
        page.tap("#go")

        with network.wearer():
            one.until(lambda: page.is_enabled("#go"))
            one.picture("sensors")
            page.tap("#go")
            at("still")
            page.tap("#go")
            one.until(lambda: page.is_visible("#still-far"))
            one.picture("still")
            at("exercise")
            assert "emulated" in page.inner_text("#origin")
            looked("exercise")
            assert page.inner_text("#exercise-name") == "Bend your elbow"
            page.tap("#go")
            at("do")
            one.until(lambda: int(page.inner_text("#count")) >= 2)
            one.arm("mirror")
            one.picture("do")
            one.inspect("do", target_px=TARGET_PX)
            assert "°" not in page.inner_text("body"), "no degrees"
            page.tap("#go")
            at("pain")
            assert page.is_disabled("#go")
            page.tap("[data-value='3']")
            looked("pain")
            page.tap("#go")
            at("done")
            looked("done", axe=False)
            page.tap("#go")
            at("exercise")
            page.tap("#go")
            at("do")
            page.tap("#stop")
            at("stopped")
            looked("stopped")
            page.tap("[data-reason='tired']")
            at("rest")
            looked("rest", axe=False)
            assert page.inner_text("#trouble") == "", "the server knows of the stop"
