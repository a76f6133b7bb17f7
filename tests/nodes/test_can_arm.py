"""An arm to a machine: frames that cantools reads, and no value that is not measured, good and of now."""

from collections.abc import Sequence
from math import cos, pi, radians, sin
from pathlib import Path

import msgspec
import pytest
from cantools import database
from hypothesis import given
from hypothesis import strategies as st

from brachium_nodes.can import arm_frames
from brachium_nodes.can.arm_frames import ArmValue, JointValue, Reason
from brachium_nodes.can.arm_output import SILENCE_NS, ArmOutput
from brachium_nodes.can.joint_table import JOINTS, JointRow, JointTable, read_joints
from brachium_nodes.can.toml_records import BadMap
from brachium_wire.messages import Calibration, Quality, SegmentPose, Skeleton

FILE = Path(arm_frames.__file__).with_name("brachium_arm.dbc")
DBC = database.load_file(FILE)
NAMES = ["".join(word.capitalize() for word in joint.split("_")) for joint in JOINTS]
TICK_NS = 20_000_000
START_NS = 1_790_000_000_000_000_000


def remainder(data: bytes, polynomial: int, bits: int, start: int, end: int) -> int:
    """The CRC bit by bit, as the sum of a long division: another way than by table."""
    value = start
    for byte in data:
        for bit in range(7, -1, -1):
            top = (value >> (bits - 1)) ^ ((byte >> bit) & 1)
            value = ((value << 1) & ((1 << bits) - 1)) ^ (polynomial if top else 0)
    return value ^ end


joints = st.builds(
    JointValue,
    st.sampled_from(Reason),
    st.floats(-16.0, 16.0),
    st.floats(-60.0, 60.0),
    st.none() | st.floats(0.0, 0.5),
)
arms = st.builds(
    ArmValue,
    st.integers(1, 2**62),
    st.none() | st.integers(0, 10**9),
    st.sampled_from(("worn", "emulated", "playback")),
    st.lists(joints, min_size=7, max_size=7),
)


def same(joint: JointValue, valid: float, reason: object, angle: float, speed: float, sd: float) -> None:
    assert valid == (joint.reason is Reason.VALID)
    assert str(reason) == joint.reason.name.lower()
    if valid:
        assert angle == pytest.approx(joint.angle_rad, abs=0.00026)
        assert speed == pytest.approx(joint.speed_rad_s, abs=0.0011)
        assert sd == pytest.approx(0.51 if joint.sd_rad is None else joint.sd_rad, abs=0.0021)
    else:
        assert angle == pytest.approx(-16.384)
        assert sd == pytest.approx(0.51)


@given(arms, st.integers(0, 15), st.sampled_from(("Right", "Left")))
def test_frames_of_8_bytes_say_what_the_database_says(arm: ArmValue, alive: int, side: str):
    first = DBC.get_message_by_name(f"{side}Sample").frame_id
    frames = arm_frames.classic_frames(first, alive, arm)
    for number, data in frames:
        assert len(data) == 8
        assert data[0] == remainder(number.to_bytes(2, "little") + data[1:], 0x1D, 8, 0xFF, 0xFF)
    read = [DBC.decode_message(number, data) for number, data in frames]
    assert {r["Alive"] for r in read} == {alive}
    assert [DBC.get_message_by_frame_id(n).name for n, _ in frames[1:]] == [side + name for name in NAMES]
    assert arm.time_ns is not None
    assert read[0]["SampleTime"] == arm.time_ns // 10**6 % (2**32 - 1)
    assert str(read[0]["Origin"]) == arm.origin
    for joint, name, one in zip(arm.joints, NAMES, read[1:], strict=True):
        assert read[0]["Valid" + name] == one["Valid"]
        same(joint, one["Valid"], one["Reason"], one["Angle"], one["Speed"], one["StandardDeviation"])
        assert one["Age"] == (510 if arm.age_ns is None else min(arm.age_ns // 2_000_000 * 2, 510))


@given(arms, st.integers(0, 15), st.sampled_from(("Right", "Left")))
def test_frames_of_64_bytes_say_what_the_database_says(arm: ArmValue, alive: int, side: str):
    first = DBC.get_message_by_name(f"{side}Sample").frame_id
    number, data = arm_frames.fd_frame(first, alive, arm)
    message = DBC.get_message_by_frame_id(number)
    assert (message.name, message.is_fd, len(data)) == (side + "Arm", True, 64)
    crc = int.from_bytes(data[:2], "little")
    assert crc == remainder(number.to_bytes(2, "little") + data[2:], 0x1021, 16, 0xFFFF, 0)
    read = message.decode(data)
    assert read["Alive"] == alive
    assert read["Age"] == (65535 if arm.age_ns is None else arm.age_ns // 10**6)
    for joint, name in zip(arm.joints, NAMES, strict=True):
        same(
            joint, *(read[name + what] for what in ("Valid", "Reason", "Angle", "Speed", "StandardDeviation"))
        )


def test_the_crcs_are_the_documented_ones():
    assert arm_frames.crc8(b"123456789") == 0x4B
    assert arm_frames.crc16(b"123456789") == 0x29B1
    assert "0x1D" in DBC_TEXT
    assert "0x1021" in DBC_TEXT


DBC_TEXT = FILE.read_text()


def test_every_message_of_the_database_says_that_it_is_no_safety_function():
    for message in DBC.messages:
        said = [message.comment or "", *(signal.comment or "" for signal in message.signals)]
        assert any("Not a safety function" in text for text in said), message.name
    assert "This is not a safety function" in DBC_TEXT


def skeleton(
    tick: int,
    elbow: float = 0.0,
    heading: float = 0.0,
    quality: Quality = "good",
    origin: str = "worn",
    **more: object,
) -> Skeleton:
    """An arm whose forearm flexes by `elbow` about x and is turned by `heading` about the vertical."""
    c, s, ch, sh = cos(elbow / 2), sin(elbow / 2), cos(heading / 2), sin(heading / 2)
    forearm = (ch * c, ch * s, sh * s, sh * c)
    poses = {
        "upper_arm_r": SegmentPose(quality="good", sequence=tick, world_from_segment=(1.0, 0.0, 0.0, 0.0)),
        "forearm_r": SegmentPose(quality=quality, sequence=tick, world_from_segment=forearm),
    }
    angles = dict.fromkeys(JOINTS[:3], 0.1) | {"elbow_flexion": elbow, "forearm_pronation": heading}
    return Skeleton(
        time_ns=START_NS + tick * TICK_NS,
        side="right",
        origin=origin,  # type: ignore[arg-type]
        forward="facing",
        trunk_from_world=(1.0, 0.0, 0.0, 0.0),
        segments=poses,
        positions={},
        angles=angles,
        assumed={} if quality == "good" else dict.fromkeys(("elbow_flexion", "forearm_pronation"), quality),
        **more,  # type: ignore[arg-type]
    )


TABLE = JointTable(subject="p01")
ELBOW, PRONATION, WRIST = 3, 4, 5


def output(skeletons: Sequence[Skeleton], table: JointTable = TABLE, **more: object) -> ArmOutput:
    made = ArmOutput(table, **more)  # type: ignore[arg-type]
    for one in skeletons:
        made.take(one)
    return made


def now(made: ArmOutput, tick: int, late_ns: int = 10_000_000) -> Sequence[JointValue]:
    return made.value(START_NS + tick * TICK_NS + late_ns, late_ns).joints


def moving(ticks: int, rate: float = 1.0, **more: object) -> list[Skeleton]:
    return [skeleton(k, elbow=0.02 * rate * k, **more) for k in range(ticks)]  # type: ignore[arg-type]


def test_an_arm_that_moves_is_valid_with_angle_speed_and_the_makers_sign_zero_and_offset():
    row = JointRow(sign=-1, zero_deg=10.0, offset_deg=90.0)
    table = JointTable(subject="p01", joint={"elbow_flexion": row})
    last = skeleton(9, elbow=0.18, angle_sd={"elbow_flexion": 0.05})
    found = now(output([*moving(9), last], table), 9)
    assert found[ELBOW].reason is Reason.VALID
    assert found[ELBOW].angle_rad == pytest.approx(-(0.18 - radians(10)) + radians(90))
    assert found[ELBOW].speed_rad_s == pytest.approx(-1.0)
    assert found[ELBOW].sd_rad == 0.05
    assert found[PRONATION].sd_rad is None
    assert found[WRIST].reason is Reason.NOT_MEASURED


@pytest.mark.parametrize("quality", ["held", "missing", "disturbed", "uncalibrated", "heading_assumed"])
def test_only_good_is_valid_and_only_for_the_joints_that_rest_on_it(quality: Quality):
    found = now(output([*moving(9), skeleton(9, 0.18, quality=quality)]), 9)
    assert found[ELBOW].reason is Reason.NOT_MEASURED
    assert found[0].reason is Reason.VALID


def test_silence_age_and_an_unknown_clock_make_all_invalid():
    made = output(moving(10))
    assert {j.reason for j in now(made, 9, SILENCE_NS)} == {Reason.VALID, Reason.NOT_MEASURED}
    assert {j.reason for j in now(made, 9, SILENCE_NS + 1)} == {Reason.SILENT}
    assert {j.reason for j in made.value(START_NS + 9 * TICK_NS + 121_000_000, 0).joints} == {Reason.STALE}
    assert {j.reason for j in made.value(START_NS, 0).joints} == {Reason.STALE}  # of the future
    assert {j.reason for j in made.value(None, 0).joints} == {Reason.STALE}
    assert {j.reason for j in ArmOutput(TABLE).value(START_NS, 0).joints} == {Reason.SILENT}


@pytest.mark.parametrize("origin", ["emulated", "playback"])
def test_what_nobody_wears_is_refused_unless_it_is_asked_for_by_name(origin: str):
    skeletons = moving(10, origin=origin)
    assert {j.reason for j in now(output(skeletons), 9)} == {Reason.ORIGIN}
    asked = output(skeletons, origins=frozenset({"worn", origin}))
    assert now(asked, 9)[ELBOW].reason is Reason.VALID


@given(
    st.floats(radians(5), radians(175)),
    st.sampled_from((1, -1)),
    st.floats(-3.0, 3.0),
    st.sampled_from((1.0, 0.5, 0.2)),
)
def test_a_heading_that_jumps_is_invalid_at_once_and_until_a_calibration(
    jump: float, sign: int, rate: float, first_part: float
):
    """The jump may fall between two ticks, so that one of them has a part of it."""
    made = output(moving(10, rate))
    for tick in range(10, 60):
        part = first_part if tick == 10 else 1.0
        made.take(skeleton(tick, 0.02 * rate * tick, heading=sign * jump * part))
        if jump * first_part > radians(3) or tick > 10:
            assert now(made, tick)[ELBOW].reason in (Reason.SETTLING, Reason.IMPLAUSIBLE)
    assert {j.reason for j in now(made, 59)} == {Reason.IMPLAUSIBLE}
    assert made.jumped == ["forearm_r"]
    for state in ("done", "running", "refused", "done"):  # warnings are told with what was done before
        made.hear(Calibration(time_ns=START_NS, state=state))
        assert made.jumped
    for state in ("waiting", "running", "done"):
        made.hear(Calibration(time_ns=START_NS, state=state))
    for tick in range(60, 66):
        made.take(skeleton(tick, 0.02 * rate * tick, heading=sign * jump))
    assert now(made, 65)[ELBOW].reason is Reason.VALID


def test_a_fast_movement_may_be_invalid_and_is_no_jump():
    """90 deg in 0.2 s is more than is taken for plausible, and it is smooth."""
    made, angle = output(moving(10, 0.0)), []
    for k in range(60):
        u = min(k * 0.02 / 0.2, 1.0)
        angle.append(radians(90) * (10 * u**3 - 15 * u**4 + 6 * u**5))
    for k, elbow in enumerate(angle):
        made.take(skeleton(10 + k, elbow))
    assert made.jumped == []
    assert now(made, 69)[ELBOW].reason is Reason.VALID


def test_a_tick_that_is_missing_is_not_bridged():
    made = output(moving(10))
    made.take(skeleton(11, 0.22))
    assert now(made, 11)[ELBOW].reason is Reason.SETTLING


def test_angles_go_on_over_a_whole_turn():
    angles = [3.0 + 0.05 * k for k in range(10)]
    skeletons = [
        msgspec.structs.replace(skeleton(k), angles={"elbow_flexion": (a + pi) % (2 * pi) - pi})
        for k, a in enumerate(angles)
    ]
    assert now(output(skeletons), 9)[ELBOW].angle_rad == pytest.approx(angles[-1])


def test_a_standard_deviation_beyond_the_makers_limit_is_invalid_and_so_is_none():
    table = JointTable(subject="p01", max_sd_deg=5.0)
    for sd, reason in ((0.08, Reason.VALID), (0.09, Reason.RANGE), (None, Reason.RANGE)):
        sds = {} if sd is None else {"elbow_flexion": sd}
        found = now(output([skeleton(k, angle_sd=sds) for k in range(10)], table), 9)
        assert found[ELBOW].reason is reason


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("side = 'right'", "subject"),
        ("subject = 'p01'\n[joint.knee]", "'knee' is not known"),
        ("subject = 'p01'\nbase_id = 0x7FF", "no room"),
        (
            "subject = 'p01'\n[joint.elbow_flexion]\nsign = 2",
            "joint elbow_flexion: sign 2 cannot be used; write -1 or 1$",
        ),
        ("subject = 'p01'\n[joint.elbow_flexion]\nzero = 2", "zero is not known; choose of sign, zero_deg, "),
        ("subject = 'p01'\nside = 'up'", 'side .up. cannot be used; write "left" or "right"$'),
        ("subject = 'p01'\njoint = 1", r"a table \[joint.NAME\] for each"),
        ("subject = 'p01'\nsubject", "cannot be read as TOML"),
        ("subject = 'p01'\nrate_hz = 5", "20 to 200"),
        ("subject = 'p01'\nmax_age_ms = 5000", "10 to 500"),
        ("subject = 'p01'\nmax_sd_deg = nan", "more than 0"),
        ("subject = 'p01'\nmax_sd_deg = -3", "more than 0"),
    ],
)
def test_a_makers_table_that_cannot_be_is_named(tmp_path: Path, text: str, said: str):
    path = tmp_path / "joints.toml"
    path.write_text(text)
    with pytest.raises(BadMap, match=said):
        read_joints(path)


def test_the_shipped_table_is_one():
    assert read_joints(FILE.with_name("joints.toml")).joint.keys() == {"elbow_flexion", "forearm_pronation"}
