from brachium_viewer.web.page_state import PageState
from brachium_wire import keys
from brachium_wire.codec import encode


def test_a_frame_holds_each_arm_once_per_skeleton(arm_at):
    state = PageState("lab")
    state.feed(keys.skeleton("lab", "p01", "right"), encode(arm_at(1.0)), 10)
    frame = state.frame(20)
    assert frame is not None
    assert frame["subject"] == "p01"
    assert list(frame["arms"]) == ["right"]
    assert state.frame(30) is None
