"""The server over real sockets: a router, the bus, and screens that speak as browsers do."""

import asyncio
import socket
import threading

import aiohttp
import pytest

from brachium_viewer.sessions.store import Store
from brachium_viewer.web import server
from brachium_wire import keys
from brachium_wire.bus import Bus
from brachium_wire.codec import decode
from brachium_wire.messages import Event, Health

pytestmark = pytest.mark.network


def test_a_screen_sees_the_arm_and_what_is_known(serve_pages, watch, moving_arm, tmp_path):
    async def look(screen):
        hello = await screen.until(lambda m: m["kind"] == "hello")
        assert hello["reference"]["elbow_flexion"] == [0.0, 150.0]
        frame = await screen.until(lambda m: m["kind"] == "frame" and m["arms"])
        assert frame["arms"]["right"]["angles"]["elbow_flexion"][1] == "good"
        state = await screen.until(lambda m: m["kind"] == "state" and m["sides"] == ["right"])
        assert state["origin"] == "emulated"
        assert [one["segment"] for one in state["sensors"]] == ["forearm_r"]

    with serve_pages(endpoint=moving_arm, sessions=tmp_path, open_door=True) as serving:
        watch(serving.address, look)


def test_a_session_from_its_first_rating_to_the_store(serve_pages, watch, moving_arm, tmp_path):
    with Bus.open(moving_arm) as bus:
        events = bus.subscribe(keys.event("lab", "p01"))

        async def session(screen):
            await screen.until(lambda m: m["kind"] == "state" and m["sides"] == ["right"])
            refused = await screen.ask("exercise", exercise="elbow-flexion", side="left")
            assert "left arm" in refused["reason"]
            assert (await screen.ask("report"))["reason"].startswith("nothing was recorded")
            assert (await screen.ask("stop"))["reason"] == "no set is running"
            assert (await screen.ask("pain", value=3, when="before"))["ok"]
            begun = await screen.ask("exercise", exercise="elbow-flexion", side="right", repetitions=2)
            assert begun["ok"], begun
            again = await screen.ask("exercise", exercise="elbow-flexion", side="right")
            assert "stop it first" in again["reason"]
            state = await screen.until(lambda m: m["kind"] == "state" and m["set"] is not None)
            assert state["recording"]["state"] == "on"
            seen = await screen.until(
                lambda m: m["kind"] == "frame" and m["set"] and m["set"]["seconds"] > 0.2
            )
            assert (await screen.ask("mark", text="here"))["ok"]
            assert (await screen.ask("subject", subject="p02", create=True))["reason"].startswith("a session")
            stopped = await screen.ask("stop")
            assert stopped["data"]["set"]["seconds"] >= seen["set"]["seconds"]
            assert (await screen.ask("patient-stop", reason="tired"))["ok"]
            done = await screen.ask("report")
            assert done["ok"], done
            state = await screen.until(lambda m: m["kind"] == "state" and m["history"])
            assert state["recording"]["state"] == "off"
            assert state["history"][0]["origin"] == "emulated"
            assert (tmp_path / done["data"]["recording"]).is_file()
            assert state["history"][0]["report"] == done["data"]["report"]
            async with aiohttp.ClientSession() as visitor:
                report = await visitor.get(serving.address + done["data"]["report"])
                assert "script" not in report.headers["Content-Security-Policy"]
                assert "p01" in await report.text()

        with serve_pages(endpoint=moving_arm, sessions=tmp_path, open_door=True) as serving:
            watch(serving.address, session)
        heard = [decode(payload, Event) for _, payload in events.drain()]
    assert [one.kind for one in heard] == ["pain", "exercise", "mark", "exercise-end", "patient-stop"]
    assert heard[3].data["reason"] == "stopped"
    with Store.open(tmp_path) as store:
        (kept,) = store.sessions("p01")
        assert kept.origin == "emulated"
        assert [one.measures.exercise for one in kept.sets] == ["elbow-flexion"]
        assert [(one.kind, one.value) for one in kept.ratings] == [("pain", 3)]
        assert store.history("p01", "elbow-flexion", "right") == ()


def test_what_cannot_be_asked_is_refused_in_one_line(serve_pages, watch, moving_arm, tmp_path, caplog):
    async def ask(screen):
        await screen.until(lambda m: m["kind"] == "state" and m["sides"])
        for verb, words in (
            ("dance", {}),
            ("pain", {"value": 11, "when": "before"}),
            ("pain", {"value": 3, "when": "now"}),
            ("exercise", {"exercise": "elbow-flexion", "side": "middle"}),
            ("exercise", {"exercise": "x", "side": "right", "goal_deg": 1e9}),
            ("subject", {"subject": "p09"}),
            ("subject", {"subject": "p01", "create": True}),
            ("subject", {"subject": "a/b", "create": True}),
        ):
            answer = await screen.ask(verb, **words)
            assert not answer["ok"], (verb, words)
            assert answer["verb"] == verb
            assert "\n" not in answer["reason"]
            assert ("load the page anew" in answer["reason"]) == (verb != "subject")
        await screen.socket.send_str("not json")
        broken = await screen.until(lambda m: m["kind"] == "answer" and m["id"] == 0)
        assert broken["reason"] == "the server does not know what this page asks: load the page anew"
        assert (await screen.ask("wear-check"))["reason"].endswith("brachium wear-check --subject p01")
        assert "fusion does not answer" in (await screen.ask("zero"))["reason"]

    with serve_pages(endpoint=moving_arm, sessions=tmp_path, open_door=True) as serving:
        watch(serving.address, ask)
    assert "`int` <= 10" in caplog.text  # what is wrong is for whoever wrote the page


def test_a_new_subject_is_told_to_the_room(serve_pages, watch, moving_arm, tmp_path):
    async def create(screen):
        await screen.until(lambda m: m["kind"] == "state" and m["subject"] == "p01")
        assert (await screen.ask("subject", subject="p02", create=True, side="left", height_m=1.7))["ok"]
        state = await screen.until(lambda m: m["kind"] == "state" and m["subject"] == "p02" and m["session"])
        assert state["session"] == {"side": "left", "height_m": 1.7, "lengths_m": {}}
        assert (await screen.ask("subject", subject="p01"))["ok"]

    with serve_pages(endpoint=moving_arm, sessions=tmp_path, open_door=True) as serving:
        watch(serving.address, create)


def test_a_screen_that_does_not_read_slows_no_other_and_skips_frames(
    serve_pages, watch, moving_arm, tmp_path
):
    with Bus.open(moving_arm) as bus:
        healths = bus.subscribe(keys.services("lab", "web/*"))

        async def look(screen):
            def skipped() -> bool:
                heard = [decode(payload, Health) for _, payload in healths.drain()]
                return any(one.counts.get("frames_skipped", 0) > 0 for one in heard)

            times = []
            async with asyncio.timeout(60.0):
                while not skipped():
                    before = times[-1] if times else 0.0
                    frame = await screen.until(lambda m, t=before: m["kind"] == "frame" and m["sent"] > t)
                    times.append(frame["sent"])
            assert times == sorted(set(times))
            assert len(times) > 20  # the one that reads was given frames all the while

        with serve_pages(endpoint=moving_arm, sessions=tmp_path, open_door=True) as serving:
            host, port = serving.address.removeprefix("http://").split(":")
            with socket.socket() as idle:
                idle.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 2048)
                idle.connect((host, int(port)))
                idle.sendall(_upgrade(f"{host}:{port}"))
                watch(serving.address, look)


def _upgrade(host: str) -> bytes:
    lines = ("GET /ws HTTP/1.1", f"Host: {host}", f"Origin: http://{host}", "Upgrade: websocket")
    more = ("Connection: Upgrade", "Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==", "Sec-WebSocket-Version: 13")
    return "\r\n".join((*lines, *more, "", "")).encode()


def test_the_door_over_http(serve_pages, router_endpoint, tmp_path):
    async def visit(serving) -> None:
        address, code = serving.address, serving.codes[0]
        ours = {"Origin": address}
        jar = aiohttp.CookieJar(unsafe=True)
        async with aiohttp.ClientSession(address, cookie_jar=jar) as visitor:
            first = await visitor.get("/", allow_redirects=False)
            assert (first.status, first.headers["Location"]) == (303, "/door?to=/")
            policy = first.headers["Content-Security-Policy"]
            assert "default-src 'self'" in policy
            assert "unsafe" not in policy
            assert first.headers["X-Content-Type-Options"] == "nosniff"
            assert (await visitor.get("/door")).status == 200
            assert (await visitor.get("/app/main.js")).status == 401
            assert (await visitor.get("/report/x")).status == 401
            assert (await visitor.get("/ws", headers=ours)).status == 401
            assert (await visitor.post("/door", data=code)).status == 403  # from no page of ours
            assert (await visitor.post("/door", data="wrong", headers=ours)).status == 403
            entered = await visitor.post("/door", data=code, headers=ours)
            assert entered.status == 204
            cookie = entered.headers["Set-Cookie"]
            assert "HttpOnly" in cookie
            assert "SameSite=Strict" in cookie
            assert (await visitor.get("/app/main.js")).status == 200
            assert (await visitor.get("/../pyproject.toml")).status == 404
            assert (await visitor.get("/report/..%2Fx")).status == 404
            assert (await visitor.get("/ws", headers={"Origin": "http://evil.example"})).status == 403
            assert (await visitor.get("/", headers={"Host": "evil.example"})).status == 403
            async with visitor.ws_connect("/ws", headers=ours) as screen:
                assert '"kind":"hello"' in (await screen.receive()).data
        async with aiohttp.ClientSession(address) as second:
            assert (await second.post("/door", data=code, headers=ours)).status == 403  # a code works once
            for wrong in (b"no text \xff\xfe", "wrong"):
                assert (await second.post("/door", data=wrong, headers=ours)).status == 403
            waits = await second.post("/door", data=serving.codes[-1], headers=ours)
            assert waits.status == 429
            assert int(waits.headers["Retry-After"]) >= 1

    with serve_pages(endpoint=router_endpoint, sessions=tmp_path) as serving:
        asyncio.run(visit(serving))


def test_a_file_is_given_again_only_when_it_changed(serve_pages, router_endpoint, tmp_path):
    async def visit(address: str) -> None:
        async with aiohttp.ClientSession(address) as visitor:
            first = await visitor.get("/app/main.js")
            assert first.headers["Content-Encoding"] == "gzip"
            tag = first.headers["ETag"]
            assert (await visitor.get("/app/main.js", headers={"If-None-Match": tag})).status == 304

    with serve_pages(endpoint=router_endpoint, sessions=tmp_path, open_door=True) as serving:
        asyncio.run(visit(serving.address))


def test_without_a_password_only_this_machine_is_served(tmp_path):
    settings = server.WebSettings(bind="192.0.2.1", open_door=True, sessions=tmp_path)
    with pytest.raises(server.WebError, match="for this machine only"):
        server.run(settings, threading.Event())


def test_a_port_that_is_taken_is_said_in_one_line(router_endpoint, tmp_path):
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        settings = server.WebSettings(endpoint=router_endpoint, port=port, sessions=tmp_path)
        with pytest.raises(server.WebError, match=f"port {port}") as error:
            server.run(settings, threading.Event())
    assert "\n" not in str(error.value)
