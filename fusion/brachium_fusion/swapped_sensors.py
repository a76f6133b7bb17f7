"""Whether two sensors of one arm were put on in each other's place, by a movement that was led. Pure.

Only what is sure is said: when an elbow is bent, the upper arm still, what turns is on the forearm.
"""

from collections.abc import Mapping, Sequence
from math import degrees

import numpy as np

from brachium_body import rotation
from brachium_body.segments import SIDES, arm_segments
from brachium_fusion.segment_records import SensorRecord, Span, rows_of

TURNED_DEG = 45.0
"""An elbow that was bent bent at least so far."""
STILL_DEG = 15.0
"""An upper arm that is held still sways no further, whatever skin does."""


def swapped(records: Mapping[str, SensorRecord], spans: Sequence[Span]) -> list[str]:
    """Return a warning for each arm whose upper-arm sensor turned in a led elbow flexion, not the other."""
    said = []
    for side in SIDES:
        upper, forearm, _ = arm_segments(side)
        bends = [span for span in spans if span.kind == "elbow-flexion"]
        if not bends or upper not in records or forearm not in records:
            continue
        near, far = (max(_turned_deg(records[s], span) for span in bends) for s in (upper, forearm))
        if near > TURNED_DEG and far < STILL_DEG:
            said.append(
                f"{upper} turned by {near:.0f} deg and {forearm} by {far:.0f} while the elbow was bent: "
                "these two sensors seem to be swapped; swap them, or their files"
            )
    return said


def _turned_deg(record: SensorRecord, span: Span) -> float:
    """Return how far a sensor turned from where it began; its 95th percentile."""
    quats = rows_of(record, span)
    if len(quats) < 2:
        return 0.0
    return degrees(float(np.percentile(rotation.angle_between(quats[0], quats), 95.0)))
