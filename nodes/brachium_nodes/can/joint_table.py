"""The machine maker's table: whose arm goes out, on which ids, and how an angle becomes the machine's."""

from math import isfinite
from pathlib import Path
from typing import Literal

import msgspec

from brachium_nodes.can.toml_records import BadMap, read_toml
from brachium_wire import keys

JOINTS = (
    "shoulder_flexion",
    "shoulder_abduction",
    "shoulder_rotation",
    "elbow_flexion",
    "forearm_pronation",
    "wrist_flexion",
    "wrist_deviation",
)
"""In the order of their frames; docs/conventions.md has their zeros and signs."""
BASE_IDS = {"right": 0x300, "left": 0x310}
IDS = 9
"""That an arm takes: one with the sample's time, seven joints, one of 64 bytes."""


class JointRow(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """machine's angle = sign * (angle - zero_deg) + offset_deg."""

    sign: Literal[1, -1] = 1
    zero_deg: float = 0.0
    """Our angle where the machine's joint stands at `offset_deg`."""
    offset_deg: float = 0.0


class JointTable(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One arm of one subject, for one machine."""

    subject: str
    side: Literal["right", "left"] = "right"
    base_id: int | None = None
    """First of nine 11-bit ids; 0x300 for a right arm, 0x310 for a left one."""
    rate_hz: float = 100.0
    """Of the frames, whatever comes from the network."""
    max_age_ms: float = 120.0
    """A sample older than this is not valid."""
    max_sd_deg: float | None = None
    """An angle with a larger stated standard deviation, or with none stated, is not valid."""
    joint: dict[str, JointRow] = {}

    @property
    def first_id(self) -> int:
        """The id of the frame with the sample's time."""
        return BASE_IDS[self.side] if self.base_id is None else self.base_id


def read_joints(path: Path) -> JointTable:
    """Return a maker's table. Raises BadMap, FileNotFoundError."""
    table = read_toml(path, JointTable)
    keys.subject_chunk(table.subject)
    unknown = set(table.joint) - set(JOINTS)
    if unknown:
        raise BadMap(f"{path}: joint {unknown.pop()!r} is not known; choose of {', '.join(JOINTS)}")
    if not 0 <= table.first_id <= 0x7FF - IDS + 1:
        raise BadMap(f"{path}: base_id {table.first_id:#x} leaves no room for {IDS} ids of 11 bits")
    if not 20.0 <= table.rate_hz <= 200.0:
        raise BadMap(f"{path}: rate_hz {table.rate_hz:g} cannot be used; write 20 to 200")
    if not 10.0 <= table.max_age_ms <= 500.0:
        raise BadMap(f"{path}: max_age_ms {table.max_age_ms:g} cannot be used; write 10 to 500")
    if table.max_sd_deg is not None and not 0.0 < table.max_sd_deg <= 180.0:
        raise BadMap(f"{path}: max_sd_deg {table.max_sd_deg:g} cannot be used; write more than 0, to 180")
    for name, row in table.joint.items():
        if not (isfinite(row.zero_deg) and isfinite(row.offset_deg)):
            raise BadMap(f"{path}: zero_deg and offset_deg of {name} must be numbers")
    return table
