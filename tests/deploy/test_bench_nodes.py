"""Gateways under load and under attack, and clocks over a bad radio: counts and orderings, never times."""

import pytest

from brachium import bench_clock, bench_gateway, bench_hostile
from brachium.hostile_frames import MESSAGES, Enemy
from brachium_nodes.websocket_frames import FrameReader

FRAMES = 4000


def test_clocks_get_better_and_say_how_good_they_are():
    found = bench_clock.measure(12)
    assert found.median_ms_60s < found.median_ms_5s < found.first_message_p95_ms_60s
    assert found.p95_ms_60s <= 0.5
    assert found.covered >= 0.95
    assert found.backwards == 0


@pytest.mark.network
def test_a_crowd_of_nodes_loses_nothing_beside_the_yardstick():
    found = bench_gateway.measure(12, 0.2, 1.0)
    assert found.samples_received == found.samples_sent == 12 * 20 * 5 * 2
    assert (found.samples_lost, found.drops) == (0, {})
    assert len(found.gateway_cpu_windows) == len(found.echo_cpu_windows) == 5
    assert sum(found.echo_cpu_windows) > 0.0


@pytest.mark.network
def test_good_nodes_lose_nothing_beside_an_attack():
    found = bench_hostile.measure(FRAMES)
    assert found.gateway_alive
    assert found.frames >= FRAMES
    assert (found.good_nodes, found.good_lost, found.good_drops) == (bench_hostile.GOOD, 0, {})
    assert found.good_received > 0
    # What was sent is what was counted: nothing of the attack was left unread.
    sent = found.by_kind
    assert found.enemy_drops["not_finite"] >= sent["NaN"] + sent["infinity"]
    assert found.enemy_drops["wrong_shape"] >= sent["wrong shape"] + sent["half a batch"] + sent["no samples"]
    assert found.enemy_drops["wrong_version"] >= sent["unknown kind"] + sent["no kind"]
    assert found.enemy_drops["malformed"] >= sent["bad MessagePack"] + sent["deep"] + sent["claims millions"]
    assert found.gateway_drops["unauthorized"] >= sent.get("handshake: wrong token", 0)
    assert found.gateway_drops["broken_handshake"] > 0
    assert found.gateway_drops["broken_websocket"] > 0


def test_the_same_seed_makes_the_same_attack():
    one, other = (Enemy(7, "t", "n") for _ in range(2))
    made = [enemy.connection()[0] + enemy.handshake() for enemy in (one, other) for _ in range(3)]
    assert made[:3] == made[3:]
    assert one.sent == other.sent
    assert Enemy(8, "t", "n").connection()[0] != made[0]


def test_an_attack_has_frames_of_every_kind():
    enemy = Enemy(1, "t", "n")
    for _ in range(150):
        enemy.connection()
        enemy.handshake()
    assert {name for name, _ in MESSAGES} <= set(enemy.sent)
    for name in ("unmasked", "oversize", "oversize in pieces", "bad UTF-8", "fragmented", "handshake: noise"):
        assert enemy.sent[name] > 0


def test_messages_that_are_wrong_inside_are_whole_outside():
    enemy, reader = Enemy(3, "t", "n"), FrameReader(4096)
    for _ in range(200):
        came, broken = reader.feed(enemy._messages())
        assert broken is None
        assert len(came) == 1
