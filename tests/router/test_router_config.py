import json

import pytest
import zenoh

from brachium_router.config import BadRouterSettings, RouterSettings, endpoint, router_json5, size_limits
from brachium_wire import keys
from brachium_wire.topics import TOPICS


def test_zenoh_takes_the_text_whole():
    """Zenoh refuses unknown keys, so this is its own word on every one of ours."""
    zenoh.Config.from_json5(router_json5(RouterSettings(users_file="/tmp/users")))


def test_the_router_listens_on_one_address_and_announces_nothing():
    config = json.loads(router_json5(RouterSettings(port=7001)))
    assert config["listen"]["endpoints"] == ["tcp/127.0.0.1:7001"]
    assert config["scouting"] == {"multicast": {"enabled": False}, "gossip": {"enabled": False}, "delay": 0}
    assert config["transport"]["shared_memory"] == {"enabled": False}
    assert config["adminspace"]["permissions"]["write"] is False


@pytest.mark.parametrize("bind", ["0.0.0.0", "::", "*", "", "eth0", "10.0.0.0/8"])
def test_what_is_not_one_address_is_refused(bind: str):
    with pytest.raises(BadRouterSettings, match="one interface"):
        router_json5(RouterSettings(bind=bind))


@pytest.mark.parametrize("port", [0, -1, 65536])
def test_a_port_outside_the_range_is_refused(port: int):
    with pytest.raises(BadRouterSettings, match="65535"):
        router_json5(RouterSettings(port=port))


def test_no_session_at_all_is_refused():
    with pytest.raises(BadRouterSettings, match="max_sessions"):
        router_json5(RouterSettings(max_sessions=0))


def test_an_ipv6_address_is_bracketed():
    assert endpoint(RouterSettings(bind="::1")) == "tcp/[::1]:7447"
    assert endpoint(RouterSettings(bind="localhost")) == "tcp/127.0.0.1:7447"


EXAMPLES = {
    "imu": keys.imu("lab", "p01", "hand_r"),
    "info": keys.info("lab", "p01", "hand_r"),
    "status": keys.status("lab", "p01", "hand_r"),
    "skeleton": keys.skeleton("lab", "p01", "right"),
    "truth": keys.truth("lab", "p01", "right"),
    "calibration": keys.calibration("lab", "p01"),
    "session": keys.session("lab", "p01"),
    "event": keys.event("lab", "p01"),
    "command": keys.command("lab", "p01", "calibrate"),
    "snapshot": keys.snapshot("lab", "p01"),
    "health": keys.service("lab", "fusion", "f1"),
}


@pytest.mark.parametrize("topic", TOPICS)
def test_each_topic_has_exactly_its_own_limit(topic: str):
    key = zenoh.KeyExpr(EXAMPLES[topic])
    found = [
        limit["size_limit"]
        for limit in size_limits()
        if "put" in limit["messages"] and any(zenoh.KeyExpr(e).includes(key) for e in limit["key_exprs"])
    ]
    assert found == [TOPICS[topic].max_bytes]
