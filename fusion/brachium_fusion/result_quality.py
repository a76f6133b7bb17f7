"""How good a table's angles and positions are, and what those rest on that are not measured. Pure."""

from collections.abc import Iterable, Sequence

import numpy as np
import numpy.typing as npt

from brachium_body.angles import SHARING_QUALITY
from brachium_body.assumptions import ASSUMPTION, FOREARM, HAND, UPPER_ARM
from brachium_body.kinematics import JOINTS
from brachium_body.segments import arm_segments
from brachium_wire.messages import Quality, Skeleton

NAMES: dict[str, tuple[str, ...]] = {
    **SHARING_QUALITY,
    **{f"{joint}_position": (joint,) for joint in JOINTS},
}
"""By the end of a column's name, `quality_elbow_angles`: the angles or the position that it tells of."""


RETURNING = (
    "where the shoulder's displacement ends or begins again, the shoulder goes there within two seconds "
    "from where it was shown"
)


def qualities(
    n: int, rows: Sequence[tuple[int, Skeleton]], names: Iterable[str]
) -> dict[str, npt.NDArray[np.str_]]:
    """Return the columns (n,) among `names` of which anything is known, by `quality_<name>`; "" where not."""
    found = {}
    for name in names:
        words = np.full(n, "", dtype="<U16")
        for row, skeleton in rows:
            words[row] = _quality(skeleton, name)
        if words.any():
            found[f"quality_{name}"] = words
    return found


def assumptions(skeletons: Iterable[Skeleton]) -> dict[str, str]:
    """Return what is assumed somewhere, by the names of `NAMES`, and on which assumptions it rests."""
    found: dict[str, dict[str, None]] = {}
    for skeleton in skeletons:
        if "assumed" in skeleton.assumed.values():
            text, from_shoulder = _assumption(skeleton)
            for name in NAMES:
                if _quality(skeleton, name) == "assumed":
                    back = name.endswith("_position") and skeleton.assumed.get("shoulder") == "assumed"
                    found.setdefault(name, {})[RETURNING if back and from_shoulder else text] = None
    return {name: "; ".join(texts) for name, texts in found.items()}


def _quality(skeleton: Skeleton, name: str) -> Quality | str:
    for one in NAMES[name]:
        if one in skeleton.angles or one in skeleton.positions:
            return skeleton.assumed.get(one, "good")
    return ""


def _assumption(skeleton: Skeleton) -> tuple[str, bool]:
    """Return what the set of known segments leaves to be assumed, and whether it shows the shoulder."""
    known = 0
    for bit, segment in zip((UPPER_ARM, FOREARM, HAND), arm_segments(skeleton.side), strict=True):
        pose = skeleton.segments.get(segment)
        known |= bit if pose is not None and pose.world_from_segment is not None else 0
    return ASSUMPTION[known], bool(known & UPPER_ARM)
