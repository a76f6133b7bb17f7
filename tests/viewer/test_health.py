"""Health from arrivals alone: what is fed is what is counted; silence, loss and strangers are named."""

from typing import Any

import numpy as np
import pytest

from brachium_viewer.health import Network
from brachium_viewer.health_records import NetworkHealth
from brachium_viewer.monitor import block, to_json
from brachium_wire import keys
from brachium_wire.codec import encode
from brachium_wire.messages import Health, Info, Message, Quality, SegmentPose, Skeleton, Status
from brachium_wire.samples import write_samples

ROOM, SECOND, T0 = "gym", 1_000_000_000, 1_700_000_000_000_000_000


class Feed:
    """A network and the moment up to which it was fed."""

    def __init__(self) -> None:
        self.network, self.now = Network(), T0

    def put(self, key: str, message: Message) -> None:
        self.network.feed(key, encode(message), self.now)

    def info(self, segment: str, **more: Any) -> None:
        named = {"node": f"n-{segment}", "rate_hz": 100.0, "origin": "worn", "host": "h", **more}
        self.put(keys.info(ROOM, "p01", segment), Info(**named))

    def stream(self, segment: str, seconds: float, *, skip: tuple[int, ...] = (), late: bool = False) -> None:
        """Feed 20 batches of 5 samples a second, without those of the numbers in `skip`."""
        for i in range(round(20 * seconds)):
            self.now += SECOND // 20
            if i not in skip:
                times = self.now + np.arange(5) * 10_000_000
                batch = write_samples(
                    sequence=5 * i,
                    time_ns=times,
                    device_us=np.arange(5) * 10_000,
                    received_ns=self.now,
                    uncertainty_ns=1,
                    acc=np.zeros((5, 3)),
                    gyr=np.zeros((5, 3)),
                    late=late,
                )
                self.put(keys.imu(ROOM, "p01", segment), batch)

    def report(self, later_s: float = 0.0) -> NetworkHealth:
        return self.network.report(self.now + round(later_s * SECOND))


def skeleton(now: int, received: int | None, quality: Quality = "good", origin: Any = "worn") -> Skeleton:
    return Skeleton(
        time_ns=now - 30_000_000,
        side="right",
        origin=origin,
        forward="sternum",
        trunk_from_world=(1.0, 0.0, 0.0, 0.0),
        segments={"forearm_r": SegmentPose(quality=quality)},
        positions={},
        angles={},
        received_ns=received,
    )


def test_a_stream_at_its_nominal_rate_is_live() -> None:
    feed = Feed()
    feed.info("forearm_r")
    feed.stream("forearm_r", 5.0)
    report = feed.report()
    (node,) = report.nodes
    assert report.headline == "1 of 1 nodes live"
    assert node.rate_hz == pytest.approx(100.0)
    assert (node.received, node.lost, node.out_of_order, node.loss) == (500, 0, 0, 0.0)
    assert node.age_s == 0.0
    assert node.node == "n-forearm_r"


def test_silence_is_stale_then_missing_by_the_limits_of_the_table() -> None:
    feed = Feed()
    feed.stream("forearm_r", 1.0)
    seen = [feed.report(s).nodes[0] for s in (0.0, 0.4, 0.6, 1.0, 2.0, 2.9, 3.1)]
    assert [n.state for n in seen] == ["live", "live", "stale", "stale", "stale", "stale", "missing"]
    assert seen[0].rate_hz == pytest.approx(100.0)
    assert 40.0 < seen[3].rate_hz < 60.0
    assert seen[4].rate_hz == seen[6].rate_hz == 0.0


def test_a_sensor_that_is_only_announced_is_missing_and_counts() -> None:
    feed = Feed()
    for segment in ("hand_r", "upper_arm_r", "sternum", "forearm_r"):
        feed.info(segment)
    feed.stream("forearm_r", 1.0)
    report = feed.report()
    assert report.headline == "1 of 4 nodes live"
    assert [n.segment for n in report.nodes] == ["sternum", "upper_arm_r", "forearm_r", "hand_r"]
    assert report.nodes[0].age_s is None


def test_gaps_are_loss_and_late_batches_are_counted() -> None:
    feed = Feed()
    feed.stream("forearm_r", 2.0, skip=(3, 4, 20), late=True)
    (node,) = feed.report().nodes
    assert (node.received, node.lost, node.late) == (185, 15, 185)
    assert node.loss == pytest.approx(15 / 200)


def test_the_gateways_count_stands_where_there_is_one() -> None:
    feed = Feed()
    feed.stream("forearm_r", 1.0, skip=(3,))
    key = keys.status(ROOM, "p01", "forearm_r")
    status = Status(
        node="n", time_ns=1, connected=True, received=900, lost=100, out_of_order=7, late=2, battery_v=3.7,
        rssi_dbm=-61.0, clock_uncertainty_ns=420_000,
    )  # fmt: skip
    feed.put(key, status)
    (node,) = feed.report().nodes
    assert (node.received, node.lost, node.out_of_order, node.late) == (900, 100, 7, 2)
    assert node.loss == 0.1
    assert (node.battery_v, node.rssi_dbm, node.clock_uncertainty_ms) == (3.7, -61.0, 0.42)
    feed.put(key, Status(node="n", time_ns=2, connected=False, received=900, lost=100, out_of_order=7))
    assert feed.report().nodes[0].state == "missing"


def test_skeletons_give_rate_latency_and_quality() -> None:
    feed = Feed()
    for i in range(200):
        feed.now += SECOND // 50
        received = None if i % 10 == 0 else feed.now - (i % 100) * 1_000_000
        feed.put(keys.skeleton(ROOM, "p01", "right"), skeleton(feed.now, received, "held"))
    (arm,) = feed.report().arms
    assert arm.rate_hz == pytest.approx(50.0)
    expected = [i % 100 for i in range(100, 200) if i % 10]  # the last two seconds
    assert arm.latency_p50_ms == pytest.approx(np.percentile(expected, 50))
    assert arm.latency_p99_ms == pytest.approx(np.percentile(expected, 99))
    assert arm.quality == {"forearm_r": "held"}
    assert arm.state == "live"


@pytest.mark.parametrize("offset_ns", [-5 * SECOND, 3600 * SECOND])
def test_another_hosts_clock_is_no_latency(offset_ns: int) -> None:
    feed = Feed()
    feed.put(keys.skeleton(ROOM, "p01", "right"), skeleton(feed.now, feed.now - offset_ns))
    assert feed.report().arms[0].latency_p50_ms is None


def test_services_are_up_while_token_and_beat_are_there() -> None:
    feed = Feed()
    health = Health(
        kind="gateway", id="g1", time_ns=1, uptime_s=1.0, waiting=["esp-2", "esp-1"], drops={"late": 3}
    )
    feed.put(keys.service(ROOM, "gateway", "g1"), health)
    feed.network.token(keys.alive(ROOM, "fusion", "main"), True)
    feed.network.token(keys.alive(ROOM, "node", "esp-1"), True)
    report = feed.report(1.0)
    assert [(s.kind, s.up) for s in report.services] == [("fusion", True), ("gateway", True)]
    assert report.waiting == ["esp-1", "esp-2"]
    assert [s.up for s in feed.report(3.5).services] == [True, False]  # its beat stopped
    feed.network.token(keys.alive(ROOM, "gateway", "g1"), False)
    assert [s.up for s in feed.report().services] == [True, False]
    assert feed.report().waiting == []


def test_what_cannot_be_read_is_counted_by_name_and_harms_nothing() -> None:
    feed = Feed()
    feed.network.feed("brachium/gym/p01/what", b"", feed.now)
    feed.network.feed(keys.status(ROOM, "p01", "hand_r"), b"\xc1", feed.now)
    feed.network.feed(keys.status(ROOM, "p01", "hand_r"), encode(skeleton(1, None)), feed.now)
    assert feed.report().drops == {"bad_key": 1, "malformed": 1, "wrong_version": 1}
    assert feed.report().nodes == []


def test_the_block_begins_with_the_count_and_says_what_to_do() -> None:
    feed = Feed()
    feed.info("forearm_r", origin="emulated")
    feed.info("hand_r", origin="emulated")
    feed.stream("forearm_r", 2.0)
    feed.put(keys.skeleton(ROOM, "p01", "right"), skeleton(feed.now, feed.now - 5_000_000, origin="emulated"))
    health = Health(kind="gateway", id="g1", time_ns=1, uptime_s=1.0, waiting=["esp-9"])
    feed.put(keys.service(ROOM, "gateway", "g1"), health)
    feed.network.token(keys.alive(ROOM, "fusion", "main"), False)
    lines = block(feed.report()).splitlines()
    assert lines[0] == "1 of 2 nodes live   [EMULATED: not worn by a person]"
    assert lines[1] == "waiting: esp-9   assign with: brachium gateway --assign esp-9=SUBJECT/SEGMENT"
    text = "\n".join(lines)
    assert "p01/forearm_r    live     n-forearm_r" in text
    assert "p01/hand_r       missing  n-hand_r" in text
    assert "100/100" in text
    assert "good: forearm_r" in text
    assert "services up: gateway/g1" in text
    assert "services DOWN: fusion/main" in text
    assert "\x1b" not in text
    assert "\x1b[31m" in block(feed.report(), colour=True)


def test_a_worn_room_is_not_marked_and_an_empty_one_says_how_to_begin() -> None:
    feed = Feed()
    assert "brachium emulate" in block(feed.report())
    feed.info("forearm_r")
    assert block(feed.report()).splitlines()[0] == "0 of 1 nodes live"


def test_the_json_line_holds_the_same() -> None:
    import json

    feed = Feed()
    feed.info("forearm_r")
    feed.stream("forearm_r", 2.0)
    line = to_json(feed.report())
    assert "\n" not in line
    value = json.loads(line)
    assert value["headline"] == "1 of 1 nodes live"
    assert value["nodes"][0]["segment"] == "forearm_r"
