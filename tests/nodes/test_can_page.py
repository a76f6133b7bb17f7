"""docs/can.md says what the code does: its files are taken, its commands exist, its words are the code's."""

import argparse
import re
import shlex
from pathlib import Path

import msgspec
import pytest

from brachium.commands import can as command
from brachium_nodes.can import arm_output, joint_table, segment_watch
from brachium_nodes.can.arm_frames import Reason
from brachium_nodes.can.grouping import TIMEOUT_NS
from brachium_nodes.can.map_files import SHIPPED, SensorMap, SensorTable

PAGE = Path(__file__).parents[2] / "docs" / "can.md"
if not PAGE.exists():
    pytest.skip("docs/ is not beside tests/", allow_module_level=True)
TEXT = PAGE.read_text()


def test_its_files_are_taken():
    sensors, made, joints = re.findall(r"```toml\n(.*?)```", TEXT, re.DOTALL)
    assert len(msgspec.toml.decode(sensors, type=SensorTable).sensor) == 2
    assert msgspec.toml.decode(made, type=SensorMap).quantities().keys() == {
        "acceleration",
        "angular_rate",
        "field",
    }
    assert msgspec.toml.decode(joints, type=joint_table.JointTable).joint["elbow_flexion"].sign == 1


def test_its_commands_exist():
    parser = argparse.ArgumentParser()
    command.configure(parser)
    lines = re.findall(r"^brachium can (.*)$", TEXT, re.MULTILINE)
    assert len(lines) == 3
    for line in lines:
        parser.parse_args(shlex.split(line))
    assert set(re.findall(r"`(--[a-z-]+)", TEXT)) <= set(parser._option_string_actions) | {"--can"}


def test_it_names_every_map_joint_and_reason():
    for path in SHIPPED.glob("*.toml"):
        assert f"| `{path.stem}` |" in TEXT
    for joint in joint_table.JOINTS:
        assert f"`{joint}`" in TEXT
    for reason in Reason:
        assert reason is Reason.VALID or f"| `{reason.name.lower()}` |" in TEXT


def test_its_numbers_are_the_codes():
    assert f"{arm_output.SILENCE_NS // 10**6} ms without a skeleton" in TEXT
    assert f"{TIMEOUT_NS // 10**6} ms after it began" in TEXT
    assert f"not wrap within {4 * TIMEOUT_NS // 10**6} ms" in TEXT
    assert f"more than {segment_watch.ACCELERATION:.0f} rad/s^2" in TEXT
    assert f"up to {segment_watch.FASTEST:.0f} rad/s^2" in TEXT
    for side, base in joint_table.BASE_IDS.items():
        assert f"{base:#x}" in TEXT, side


@pytest.mark.parametrize(("length", "least", "most"), [(4, 79, 95), (6, 95, 115), (8, 111, 135)])
def test_the_bits_of_a_frame_are_added_up_right(length: int, least: int, most: int):
    assert 47 + 8 * length == least
    assert least + (33 + 8 * length) // 4 == most
