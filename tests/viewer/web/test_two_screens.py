"""Two screens that want opposite things at once: whatever is answered as done is in a recording."""

import asyncio
import json
from collections.abc import Mapping, Sequence

import aiohttp

from brachium_viewer.sessions.store import Store

EXERCISE = {"exercise": "elbow-flexion", "side": "right"}


def ask_at_once(address: str, *rounds: Sequence[tuple[str, Mapping[str, object]]]) -> list[list[dict]]:
    """Ask each round's requests at once, each from a screen of its own; return the answers by round."""

    async def ask(socket: aiohttp.ClientWebSocketResponse, number: int, verb: str, words: Mapping) -> dict:
        await socket.send_json({"kind": "do", "id": number, "verb": verb, **words})
        async with asyncio.timeout(60.0):
            while True:
                message = json.loads((await socket.receive()).data)
                if message["kind"] == "answer" and message["id"] == number:
                    return message

    async def run() -> list[list[dict]]:
        async with aiohttp.ClientSession() as session:
            opened = [session.ws_connect(f"{address}/ws", headers={"Origin": address}) for _ in range(3)]
            sockets = [await one for one in opened]
            async with asyncio.timeout(60.0):
                while True:
                    message = json.loads((await sockets[0].receive()).data)
                    if message["kind"] == "state" and message["sides"] == ["right"]:
                        break
            answers = []
            for number, requests in enumerate(rounds):
                asked = zip(sockets, requests, strict=False)
                answers.append(list(await asyncio.gather(*(ask(s, number, v, w) for s, (v, w) in asked))))
            for socket in sockets:
                await socket.close()
            return answers

    return asyncio.run(run())


def test_a_set_begun_while_another_screen_ends_the_session_is_in_the_next_one(
    moving_arm, serve_pages, tmp_path
):
    with serve_pages(endpoint=moving_arm, sessions=tmp_path, open_door=True) as serving:
        _, _, (ended, begun, marked), _, (ended_again,) = ask_at_once(
            serving.address,
            [("exercise", EXERCISE)],
            [("stop", {})],
            [("report", {}), ("exercise", EXERCISE), ("mark", {"text": "here"})],
            [("stop", {})],
            [("report", {})],
        )
    assert ended["ok"]
    assert begun["ok"]
    assert marked["ok"]
    assert ended_again["ok"], ended_again
    with Store.open(tmp_path) as store:
        assert [len(one.sets) for one in store.sessions("p01")] == [1, 1]


def test_a_session_is_ended_once_and_no_calibration_turns_a_running_set(moving_arm, serve_pages, tmp_path):
    with serve_pages(endpoint=moving_arm, sessions=tmp_path, open_door=True) as serving:
        _, turned, _, ended = ask_at_once(
            serving.address,
            [("exercise", EXERCISE)],
            [("zero", {}), ("calibrate", {"routine": "pose"})],
            [("stop", {})],
            [("report", {}), ("report", {})],
        )
    assert ["stop it first" in one["reason"] for one in turned] == [True, True]
    assert sorted(one["ok"] for one in ended) == [False, True]
    assert any("nothing was recorded" in one["reason"] for one in ended)
