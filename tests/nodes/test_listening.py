"""Which addresses are listened at: those of one interface."""

import pytest

from brachium_nodes.listening import BadAddress, listening_address


@pytest.mark.parametrize(
    ("bind", "address"),
    [
        ("127.0.0.1", "127.0.0.1"),
        ("localhost", "127.0.0.1"),
        ("::1", "::1"),
        ("192.168.1.20", "192.168.1.20"),
    ],
)
def test_an_interface_is_named_by_its_address_and_this_machine_by_name_too(bind: str, address: str) -> None:
    assert listening_address(bind) == address


@pytest.mark.parametrize(
    ("bind", "said"),
    [("0.0.0.0", "everywhere"), ("::", "everywhere"), ("lan", "no address"), ("", "no address")],
)
def test_no_other_word_and_not_all_of_them(bind: str, said: str) -> None:
    with pytest.raises(BadAddress, match=said):
        listening_address(bind)
