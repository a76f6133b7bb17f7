"""Real sockets, a real router process: what a node meets at the gateway's door and behind it."""

import asyncio
import threading
import time
from collections.abc import Callable, Coroutine

import numpy as np
import pytest
from websockets.asyncio.client import connect
from websockets.exceptions import ConnectionClosed, InvalidStatus

from brachium_nodes import node_frames as f
from brachium_nodes.gateway import GatewaySettings, run, token_sha256
from brachium_nodes.listening import BadAddress, CannotListen
from brachium_nodes.node_client import NodeClient, NotWelcome
from brachium_nodes.roster import NodeEntry
from brachium_wire import keys
from brachium_wire.codec import decode, encode
from brachium_wire.hosttime import NoHostTime, follow_host_time
from brachium_wire.messages import Answer, Command, Health
from brachium_wire.samples import read_samples

pytestmark = pytest.mark.network

ROOM = "test"
WITHIN_S = 60.0


def entry(node: str, segment: str, subject: str = "p01", token: str = "secret") -> NodeEntry:
    return NodeEntry(id=node, token_sha256=token_sha256(token), subject=subject, segment=segment)


opened: list[NodeClient] = []


def device_us() -> int:
    return time.monotonic_ns() // 1000 + 7_000_000


def client(url: str, node: str = "n1", token: str = "secret", **more: object) -> NodeClient:
    hello = f.Hello(**{"node": node, "boot": 1, "chip": "MPU-9150", "rate_hz": 100.0, **more})
    opened.append(NodeClient(url, token, hello, device_us))
    return opened[-1]


BOOT_US = device_us()


def batch(sequence: int, n: int = 5) -> f.Batch:
    rows = np.full((n, 3), sequence, dtype="<f4").tobytes()
    offsets = (np.arange(n) * 1000).astype("<u4").tobytes()
    return f.Batch(
        sequence=sequence, device_us=BOOT_US + sequence * 1000, offsets=offsets, acc=rows, gyr=bytes(12 * n)
    )


def play(work: Callable[[], Coroutine[None, None, None]]) -> None:
    async def bounded() -> None:
        try:
            async with asyncio.timeout(WITHIN_S):
                await work()
        finally:
            while opened:
                await opened.pop().close()
            await asyncio.sleep(0)  # transports that were aborted close in the next turn of the loop

    asyncio.run(bounded())


async def until(condition: Callable[[], object], what: str) -> None:
    try:
        async with asyncio.timeout(WITHIN_S):
            while not condition():
                await asyncio.sleep(0.01)
    except TimeoutError:
        raise AssertionError(f"waited {WITHIN_S:g} s for: {what}") from None


async def turned_away(node: NodeClient) -> f.Refused:
    """Return why a node may not stay, told at the door or once the gateway hears of the other one."""
    try:
        await node.join()
    except NotWelcome as error:
        return f.Refused(code=error.code, reason=str(error), retry_s=error.retry_s)
    await node.closed()
    assert node.refused is not None
    return node.refused


async def joined_when_free(node: NodeClient) -> f.Welcome:
    """Join as nodes do: again, while the gateway has not yet heard that the other one gave its subject up."""
    while True:
        try:
            return await node.join()
        except NotWelcome as error:
            if error.code != "second_host":
                raise
        await asyncio.sleep(0.01)


def test_what_a_node_sends_arrives_counted_exactly(gateway, listener, bus) -> None:
    url = gateway(entry("n1", "forearm_r")).url

    async def work() -> None:
        node = client(url)
        await node.join()
        await until(lambda: bus.alive(keys.alive(ROOM, "node", "n1")), "the node's token")
        for sequence in (0, 5, 15, 10, 20, 20, 35):  # 10 swapped, 20 twice, 25 to 34 lost
            await node.send(batch(sequence))
        await node.leave(47)
        await until(lambda: not bus.alive(keys.alive(ROOM, "node", "n1")), "the token's end")
        await until(lambda: [s for s in listener.of("status") if not s.connected], "the last status")

    play(work)
    last = listener.of("status")[-1]
    assert (last.received, last.lost, last.out_of_order) == (30, 10 + 7, 5)
    assert last.drops == {"repeated": 5}
    assert [b.sequence for b in listener.of("imu", "forearm_r")] == [0, 5, 15, 10, 20, 35]
    topics = [k.topic for k, _ in listener.heard]
    assert topics.index("info") < topics.index("imu")


def test_bad_frames_are_counted_by_name_beside_the_good_ones(gateway, listener) -> None:
    url = gateway(entry("n1", "forearm_r")).url
    bad = [
        b"\xc1",
        b"\xff" * 40,
        encode(
            f.Batch(sequence=5, device_us=BOOT_US, offsets=bytes(4), acc=b"\0\0\xc0\x7f" * 3, gyr=bytes(12))
        ),
        encode(f.Batch(sequence=5, device_us=BOOT_US, offsets=bytes(4), acc=bytes(11), gyr=bytes(12))),
        encode(
            f.Batch(
                sequence=5, device_us=BOOT_US, offsets=bytes(4), acc=b"\x28\x6b\x6e\x4e" * 3, gyr=bytes(12)
            )
        ),
        encode(f.NodeStatus(battery_v=1e6)),
    ]

    async def work() -> None:
        async with connect(url, additional_headers={"Authorization": "Bearer secret"}) as socket:
            await socket.send(encode(f.Hello(node="n1", boot=1, chip="MPU-9150", rate_hz=100.0)))
            await socket.send(encode(batch(0)))
            for frame in bad:
                await socket.send(frame)
            await socket.send(encode(batch(5)))
            await socket.send(encode(batch(5)))
            await socket.send(encode(f.Bye(next_sequence=10)))
            await until(lambda: [s for s in listener.of("status") if not s.connected], "the last status")

    play(work)
    last = listener.of("status")[-1]
    assert (last.received, last.lost) == (10, 0)
    assert last.battery_v is None
    assert last.drops == {
        "malformed": 2,
        "not_finite": 1,
        "wrong_shape": 1,
        "out_of_range": 2,
        "repeated": 5,
    }
    assert [b.sequence for b in listener.of("imu", "forearm_r")] == [0, 5]


@pytest.mark.parametrize("first", [b"\xc1", encode(f.Bye(next_sequence=1)), bytes(9000)])
def test_a_bad_first_frame_is_counted_at_the_gateway(gateway, listener, first: bytes) -> None:
    url = gateway(entry("n1", "forearm_r")).url

    async def work() -> None:
        async with connect(url, additional_headers={"Authorization": "Bearer secret"}) as socket:
            await socket.send(first)
            await socket.wait_closed()
        await until(
            lambda: any(h.drops == {"bad_hello": 1} for h in listener.of("health") if h.kind == "gateway"),
            "the gateway's count",
        )

    play(work)


def test_host_times_are_the_gateway_s(gateway, listener, bus) -> None:
    url = gateway(entry("n1", "forearm_r")).url
    clock = follow_host_time(bus, ROOM, "gw-a")
    sent: list[int] = []

    async def work() -> None:
        node = client(url)
        await node.join()
        for sequence in range(0, 100, 5):
            frame = batch(sequence)
            sent.append(frame.device_us)
            await node.send(frame)
            await asyncio.sleep(0.01)
        await node.leave(100)
        await until(lambda: len(listener.of("imu")) == 20, "20 batches")

    play(work)
    for us, one in zip(sent, listener.of("imu"), strict=True):
        true_ns = clock.at((us - 7_000_000) * 1000)
        error_ns = abs(one.time_ns - true_ns)
        assert error_ns <= one.uncertainty_ns + clock.uncertainty_ns + 1000
    times = [t for b in listener.of("imu") for t in read_samples(b).time_ns]
    assert times == sorted(set(times))


def test_nobody_tells_the_time_of_a_host_that_is_not_there(bus) -> None:
    with pytest.raises(NoHostTime, match="nowhere"):
        follow_host_time(bus, ROOM, "nowhere", timeout_s=0.2)


@pytest.mark.parametrize("headers", [{}, {"Authorization": "Bearer wrong"}, {"Authorization": "secret"}])
def test_a_bad_token_is_turned_away_before_the_upgrade(gateway, headers) -> None:
    url = gateway(entry("n1", "forearm_r")).url

    async def work() -> None:
        with pytest.raises(InvalidStatus) as refused:
            await connect(url, additional_headers=headers)
        assert refused.value.response.status_code == 401

    play(work)


def test_the_client_says_that_its_token_is_wrong(gateway) -> None:
    url = gateway(entry("n1", "forearm_r")).url

    async def work() -> None:
        with pytest.raises(NotWelcome, match="token") as refused:
            await client(url, token="wrong").join()
        assert refused.value.code == "wrong_token"

    play(work)


def test_an_unknown_node_is_listed_as_waiting_and_assigned_live(gateway, listener, bus) -> None:
    url = gateway(entry("n1", "forearm_r")).url

    async def work() -> None:
        with pytest.raises(NotWelcome) as refused:
            await client(url, "n2").join()
        assert refused.value.code == "unknown_node"
        await until(lambda: any("n2" in h.waiting for h in listener.of("health")), "n2 waiting")
        question = encode(Command(arguments={"id": "n2", "segment": "hand_r"}))
        reply = await asyncio.to_thread(bus.ask, keys.command(ROOM, "p01", "assign"), question, WITHIN_S)
        assert decode(reply, Answer).ok
        assert (await client(url, "n2").join()).segment == "hand_r"

    play(work)


def test_assigning_a_connected_node_sends_it_to_its_new_place(gateway, bus) -> None:
    url = gateway(entry("n1", "forearm_r")).url

    async def work() -> None:
        node = client(url)
        await node.join()
        question = encode(Command(arguments={"id": "n1", "segment": "forearm_l"}))
        reply = await asyncio.to_thread(bus.ask, keys.command(ROOM, "p02", "assign"), question, WITHIN_S)
        assert decode(reply, Answer).ok
        assert await node.closed() == f.CLOSE_CODES["reassigned"]
        welcome = await node.join()
        assert (welcome.subject, welcome.segment) == ("p02", "forearm_l")
        new = keys.info(ROOM, "p02", "forearm_l")
        await until(lambda: infos(bus) == [new], "the info at the new place alone")
        await node.leave(0)

    play(work)


def infos(bus) -> list[str]:
    return sorted(key for key, _ in bus.fetch(keys.subjects(ROOM, "imu/*/info")))


def assign(bus, node: str, subject: str, segment: str) -> Answer:
    question = encode(Command(arguments={"id": node, "segment": segment}))
    return decode(bus.ask(keys.command(ROOM, subject, "assign"), question, timeout_s=WITHIN_S), Answer)


def test_the_info_of_a_node_assigned_away_is_forgotten_unless_another_took_the_place(gateway, bus) -> None:
    url = gateway(entry("n1", "forearm_r"), entry("n2", "hand_r")).url

    async def joined(node: str) -> None:
        one = client(url, node)
        await one.join()
        await one.leave(0)

    async def work() -> None:
        await joined("n1")
        await joined("n2")
        hand, fore = keys.info(ROOM, "p01", "hand_r"), keys.info(ROOM, "p01", "forearm_r")
        await until(lambda: infos(bus) == [fore, hand], "both infos, though both nodes are off")
        assert (await asyncio.to_thread(assign, bus, "n1", "p01", "upper_arm_r")).ok
        await until(lambda: infos(bus) == [hand], "the hand's info alone")
        assert (await asyncio.to_thread(assign, bus, "n1", "p01", "hand_r")).ok
        await joined("n1")  # n2 is off: its place is free
        assert (await asyncio.to_thread(assign, bus, "n2", "p01", "forearm_r")).ok
        await joined("n2")
        await until(lambda: infos(bus) == [fore, hand], "the infos of both new places")

    play(work)


@pytest.mark.parametrize("question", [b"", b"\xc1", encode(Command(arguments={"id": 3, "segment": "x"}))])
def test_a_bad_assignment_is_answered_with_the_reason(gateway, bus, question) -> None:
    gateway(entry("n1", "forearm_r"))
    answer = decode(bus.ask(keys.command(ROOM, "p01", "assign"), question, timeout_s=WITHIN_S), Answer)
    assert not answer.ok
    assert "assign" in answer.reason


def test_assigning_a_node_that_nobody_knows_is_refused(gateway, bus) -> None:
    gateway(entry("n1", "forearm_r"))
    question = encode(Command(arguments={"id": "ghost", "segment": "hand_r"}))
    answer = decode(bus.ask(keys.command(ROOM, "p01", "assign"), question, timeout_s=WITHIN_S), Answer)
    assert not answer.ok
    assert "ghost" in answer.reason


def test_an_oversize_message_closes_with_1009_and_is_counted(gateway, listener) -> None:
    url = gateway(entry("n1", "forearm_r")).url

    async def work() -> None:
        node = client(url)
        await node.join()
        await node.send_bytes(bytes(5000))
        assert await node.closed() == 1009
        await until(lambda: [s for s in listener.of("status") if not s.connected], "the last status")

    play(work)
    assert listener.of("status")[-1].drops == {"oversize": 1}


def test_malformed_frames_are_counted_and_the_connection_goes_on(gateway, listener) -> None:
    url = gateway(entry("n1", "forearm_r")).url

    async def work() -> None:
        node = client(url)
        await node.join()
        await node.send(batch(0))
        await node.send_bytes(b"\xc1")
        await node.send_bytes(b"\x81\xa1m\xa7batch/9")
        await node.send(batch(5))
        await node.leave(10)
        await until(lambda: [s for s in listener.of("status") if not s.connected], "the last status")

    play(work)
    last = listener.of("status")[-1]
    assert last.drops == {"malformed": 1, "wrong_version": 1}
    assert (last.received, last.lost) == (10, 0)


def test_the_newest_connection_of_a_node_wins(gateway, listener) -> None:
    url = gateway(entry("n1", "forearm_r")).url

    async def work() -> None:
        old, new = client(url), client(url)
        await old.join()
        await old.send(batch(0))
        await until(lambda: listener.of("imu"), "the old connection's batch")
        await new.join()
        assert await old.closed() == f.CLOSE_CODES["replaced"]
        await new.send(batch(5))
        await until(lambda: len(listener.of("imu")) == 2, "the new connection's batch")
        await new.leave(10)
        await until(lambda: [s for s in listener.of("status") if not s.connected], "the last status")

    play(work)
    last = [s for s in listener.of("status") if not s.connected]
    assert len(last) == 1
    assert (last[0].received, last[0].lost) == (10, 0)


def test_a_taken_segment_is_free_again_when_its_node_is_gone(gateway, bus) -> None:
    url = gateway(entry("n1", "forearm_r"), entry("n2", "forearm_r")).url

    async def work() -> None:
        first, second = client(url), client(url, "n2")
        await first.join()
        with pytest.raises(NotWelcome, match="n1") as refused:
            await second.join()
        assert refused.value.code == "segment_taken"
        await first.close()  # without a word, as when its battery fails
        await until(lambda: not bus.alive(keys.alive(ROOM, "node", "n1")), "n1's token gone")
        assert (await second.join()).segment == "forearm_r"
        await second.leave(0)

    play(work)


def test_a_second_gateway_for_a_subject_is_refused_with_a_message(gateway, bus) -> None:
    nodes = entry("n1", "forearm_r"), entry("n2", "hand_r"), entry("n3", "hand_r", "p02")
    a, b = gateway(*nodes, id="gw-a").url, gateway(*nodes, id="gw-b").url

    async def work() -> None:
        first = client(a)
        await first.join()
        await until(lambda: bus.alive(keys.alive(ROOM, "host", "p01--gw-a")), "gw-a's claim")

        refused = await turned_away(client(b, "n2"))
        assert refused.code == "second_host"
        assert "gw-a" in refused.reason
        assert (await client(b, "n3").join()).host == "gw-b"  # another subject may
        await first.leave(0)
        await until(lambda: not bus.alive(keys.alive(ROOM, "host", "p01--gw-a")), "the claim's end")
        assert (await joined_when_free(client(b, "n2"))).host == "gw-b"

    play(work)


def test_an_ending_gateway_says_goodbye_with_final_counts(gateway, listener) -> None:
    running = gateway(entry("n1", "forearm_r"))

    async def work() -> None:
        node = client(running.url)
        await node.join()
        await node.send(batch(0))
        await until(lambda: listener.of("imu"), "the batch")
        running.stop.set()
        assert await node.closed() == 1001
        await until(lambda: [s for s in listener.of("status") if not s.connected], "the last status")

    play(work)
    running.end()
    assert listener.of("status")[-1].received == 5


def test_the_health_says_where_and_how_many(gateway, listener) -> None:
    url = gateway(entry("n1", "forearm_r")).url

    async def work() -> None:
        node = client(url)
        await node.join()
        await node.send(batch(0))

        def seen() -> list[Health]:
            return [h for h in listener.of("health") if h.counts.get("samples") == 5]

        await until(seen, "health with 5 samples")
        assert seen()[-1].text == url
        assert seen()[-1].counts["nodes"] == 1
        await node.leave(5)

    play(work)


def test_a_port_in_use_is_named_with_what_to_do(gateway, endpoint) -> None:
    port = int(gateway(entry("n1", "forearm_r")).url.split(":")[2].split("/")[0])
    with pytest.raises(CannotListen, match=f"port {port} .*--port"):
        run(GatewaySettings(endpoint=endpoint, room=ROOM, id="gw-b", port=port), threading.Event())


@pytest.mark.parametrize(
    ("bind", "said"), [("0.0.0.0", "everywhere"), ("::", "everywhere"), ("lan", "no address")]
)
def test_an_address_that_is_no_one_interface_is_refused(endpoint, bind, said) -> None:
    with pytest.raises(BadAddress, match=said):
        run(GatewaySettings(endpoint=endpoint, room=ROOM, bind=bind), threading.Event())


def test_only_the_node_path_is_served(gateway) -> None:
    url = gateway(entry("n1", "forearm_r")).url.replace("/node", "/other")

    async def work() -> None:
        with pytest.raises(InvalidStatus) as refused:
            await connect(url, additional_headers={"Authorization": "Bearer secret"})
        assert refused.value.response.status_code == 404

    play(work)


def test_an_unmasked_or_broken_websocket_frame_ends_only_that_connection(gateway, listener) -> None:
    url = gateway(entry("n1", "forearm_r"), entry("n2", "hand_r")).url

    async def work() -> None:
        good, bad = client(url), client(url, "n2")
        await good.join()
        await bad.join()
        assert bad._socket is not None
        bad._socket.transport.write(b"\x82\x03abc")  # not masked: RFC 6455 5.1 forbids it
        assert await bad.closed() == 1002
        await good.send(batch(0))
        await until(lambda: listener.of("imu", "forearm_r"), "the good node's batch")
        await good.leave(5)

    play(work)


async def _silent(url: str) -> int:
    socket = await connect(url, additional_headers={"Authorization": "Bearer secret"})
    with pytest.raises(ConnectionClosed):
        await socket.recv()
    return socket.close_code or 0


def test_who_says_no_hello_is_sent_away(gateway) -> None:
    url = gateway(entry("n1", "forearm_r")).url

    async def work() -> None:
        assert await _silent(url) == f.CLOSE_NO_HELLO

    play(work)
