"""What is pressed arrives: marks, a stop while nobody is chosen, the server's end amid a calibration."""

import asyncio
from queue import SimpleQueue

import pytest

from brachium_wire import keys
from brachium_wire.bus import Bus

pytestmark = pytest.mark.network


def test_no_mark_is_refused_while_the_recorder_is_there(serve_pages, watch, moving_arm, tmp_path):
    async def mark(screen):
        await screen.until(lambda m: m["kind"] == "state" and m["sides"] == ["right"])
        answers = [await screen.ask("mark") for _ in range(60)]
        assert [one["reason"] for one in answers if not one["ok"]] == []

    with serve_pages(endpoint=moving_arm, sessions=tmp_path, open_door=True) as serving:
        watch(serving.address, mark)


def test_a_server_ends_while_a_calibration_is_waited_for(serve_pages, watch, moving_arm, tmp_path):
    asked: SimpleQueue[object] = SimpleQueue()
    held = []

    async def calibrate(screen):
        await screen.until(lambda m: m["kind"] == "state" and m["subject"] == "p01")
        await screen.socket.send_json({"kind": "do", "id": 1, "verb": "calibrate"})
        held.append(await asyncio.to_thread(asked.get, timeout=60.0))

    with Bus.open(moving_arm) as bus:
        bus.serve_later(keys.command("lab", "p01", "calibrate"), lambda *question: asked.put(question))
        with serve_pages(endpoint=moving_arm, sessions=tmp_path, open_door=True) as serving:
            watch(serving.address, calibrate)
        assert len(held) == 1


def test_a_patients_stop_arrives_while_nobody_is_chosen(serve_pages, watch, router_endpoint, tmp_path):
    async def stop(screen):
        assert (await screen.ask("patient-stop", reason="dizzy"))["ok"]
        state = await screen.until(lambda m: m["kind"] == "state" and m["stopped"] == "dizzy")
        assert state["subject"] is None

    with serve_pages(endpoint=router_endpoint, sessions=tmp_path, open_door=True) as serving:
        watch(serving.address, stop)
