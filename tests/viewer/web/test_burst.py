"""A screen that asks many things at once is answered each of them."""

import asyncio
import json

BURST = 30


def test_every_request_of_a_burst_is_answered(router_endpoint, serve_pages, watch, tmp_path):
    async def asks(screen):
        await screen.until(lambda m: m["kind"] == "state")
        for number in range(BURST):
            await screen.socket.send_json({"kind": "do", "id": number, "verb": "stop"})
        answered: set[int] = set()
        async with asyncio.timeout(60.0):
            while len(answered) < BURST:
                message = json.loads((await screen.socket.receive()).data)
                if message["kind"] == "answer":
                    assert not message["ok"]
                    answered.add(message["id"])

    with serve_pages(endpoint=router_endpoint, sessions=tmp_path, open_door=True) as serving:
        watch(serving.address, asks)
