"""A session whose disk fills up: what the pages say is so, and nothing that was kept is lost."""

import asyncio

import pytest

from brachium_viewer.sessions.store import Store

pytestmark = pytest.mark.network

EXERCISE = {"exercise": "elbow-flexion", "side": "right", "language": "de"}


def recording_is(how: str):
    return lambda m: m["kind"] == "state" and m["recording"]["state"] == how


def test_a_disk_that_fills_up_stops_the_recording_and_says_so_until_the_next_begins(
    serve_pages, watch, moving_arm, disk, tmp_path
):
    async def session(screen):
        async def hear(found):
            screen.last.clear()  # only what is said from now on
            return await screen.until(found)

        await screen.until(lambda m: m["kind"] == "state" and m["sides"] == ["right"])
        assert (await screen.ask("exercise", **EXERCISE))["ok"]
        assert (await hear(recording_is("on")))["alarms"] == []
        disk.room, disk.reserve = 0, 1 << 20  # full from now on; closing finds the room that was kept for it
        state = await hear(recording_is("failed"))
        (alarm,) = state["alarms"]
        assert alarm["what"] == "recording"
        assert "Make room" in alarm["reason"]
        assert (await hear(lambda m: m["kind"] == "frame" and m["set"]))["arms"]["right"]["stale"] is False
        assert (await screen.ask("mark"))["reason"] == alarm[
            "reason"
        ]  # nothing is said to be kept that is not
        assert (await screen.ask("patient-stop", reason="tired"))["ok"]
        assert (await hear(lambda m: m["kind"] == "state"))["stopped"] == "tired"
        disk.room = disk.reserve = 0
        again = await screen.ask("exercise", **EXERCISE)
        assert "No space left" in again["reason"]
        state = await hear(recording_is("failed"))
        assert [one["reason"] for one in state["alarms"]] == [again["reason"]]
        disk.room = 1 << 30
        assert (await screen.ask("exercise", **EXERCISE))["ok"]
        assert (await hear(recording_is("on")))["alarms"] == []
        await asyncio.sleep(0.1)
        done = await screen.ask("report", language="de")
        assert done["ok"], done
        assert done["data"]["ended"] == ""
        await hear(lambda m: m["kind"] == "state" and len(m["history"]) == 2)

    with serve_pages(endpoint=moving_arm, sessions=tmp_path, open_door=True) as serving:
        watch(serving.address, session)
    with Store.open(tmp_path) as store:
        assert [len(one.sets) for one in store.sessions("p01")] == [1, 1]
    reports = [path.read_text("utf-8") for path in tmp_path.glob("*.html")]
    assert ["Sitzung von p01" in report for report in reports] == [True, True]


def test_the_alarm_outlives_the_session_that_it_ended(serve_pages, watch, moving_arm, disk, tmp_path):
    async def session(screen):
        await screen.until(lambda m: m["kind"] == "state" and m["sides"] == ["right"])
        assert (await screen.ask("exercise", **EXERCISE))["ok"]
        disk.room, disk.reserve = 0, 1 << 20
        (alarm,) = (await screen.until(recording_is("failed")))["alarms"]
        done = await screen.ask("report")
        assert done["ok"], done
        assert done["data"]["ended"] == alarm["reason"]
        screen.last.clear()
        state = await screen.until(lambda m: m["kind"] == "state" and m["history"])
        assert (state["recording"]["state"], state["alarms"]) == ("failed", [alarm])
        disk.room = 1 << 30
        assert (await screen.ask("pain", value=3, when="after"))["ok"]
        screen.last.clear()
        assert (await screen.until(recording_is("on")))["alarms"] == []

    with serve_pages(endpoint=moving_arm, sessions=tmp_path, open_door=True) as serving:
        watch(serving.address, session)
