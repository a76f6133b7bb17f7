"""Two hosts and one subject: whoever came first has it, and of two at once exactly one stays."""

import pytest

from brachium_nodes.host_claim import HostClaims, checked_host
from brachium_wire.bus import Bus
from brachium_wire.keys import BadKey

ROOM = "claims"


@pytest.mark.network
def test_a_claim_is_seen_by_others_until_it_is_released(endpoint, waiting) -> None:
    with Bus.open(endpoint) as bus_a, Bus.open(endpoint) as bus_b:
        a, b = HostClaims(bus_a, ROOM, "gw-a"), HostClaims(bus_b, ROOM, "gw-b")
        a.claim("p01")
        a.claim("p01--x")  # a subject whose name looks like a claim
        waiting(lambda: b.other("p01") == "gw-a", "gw-b sees the claim")
        assert a.other("p01") is None
        assert b.other("p02") is None
        a.release("p01")
        waiting(lambda: b.other("p01") is None, "gw-b sees the release")
        assert b.other("p01--x") == "gw-a"


@pytest.mark.network
def test_of_two_that_claim_at_once_one_gives_way(endpoint, waiting) -> None:
    with Bus.open(endpoint) as bus_a, Bus.open(endpoint) as bus_b:
        a, b = HostClaims(bus_a, ROOM, "gw-a"), HostClaims(bus_b, ROOM, "gw-b")
        a.claim("p03")
        b.claim("p03")
        waiting(lambda: a.other("p03") and b.other("p03"), "both see both")
        assert not a.yields("p03")
        assert b.yields("p03")
        bus_a.close()
        waiting(lambda: not b.yields("p03"), "the survivor keeps it")


@pytest.mark.parametrize("host", ["a--b", "-a", "a/b", "", "*"])
def test_a_host_name_that_would_be_misread_is_refused(host) -> None:
    with pytest.raises(BadKey):
        checked_host(host)
