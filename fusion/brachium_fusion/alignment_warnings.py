"""What a person should know of an alignment: assumed headings, and the angles that rest on them. Pure."""

from collections.abc import Collection, Mapping, Sequence
from itertools import pairwise

from brachium_body.segments import SIDES, arm_segments, part_of
from brachium_fusion.wear_words import place
from brachium_wire.messages import Forward

BETWEEN: dict[tuple[str, str], str] = {
    ("sternum", "upper_arm"): "shoulder and trunk angles",
    ("upper_arm", "forearm"): "elbow angles",
    ("forearm", "hand"): "wrist angles",
}
"""What rests on the heading between two neighbours; with a segment left out, only directions do."""
TO_DO = "give the nominal mounting"
ELBOW_TO_DO = "give the nominal mounting or bend the elbow while it is calibrated"
MISPLACED_DEG = 45.0
"""A sensor that sits further from its nominal mounting is on another place, or the wrong way round."""


def warnings_for(
    forward: Forward,
    segments: Collection[str],
    assumed: Collection[str],
    tied: Sequence[Collection[str]],
    scores: Mapping[str, float],
) -> tuple[str, ...]:
    """Return one line each for forward, for headings between neighbours, and for sensors far from nominal.

    `assumed` are the segments whose heading against the trunk no rule gives; each group in `tied` shares one
    heading, whether that is known or not.
    """
    warnings = [_forward(segments, assumed)] if forward == "none" else []
    warnings += _loose(segments, assumed, tied)
    for name, value in scores.items():
        if name.startswith("from_nominal_deg_") and value > MISPLACED_DEG:
            on = place(name.removeprefix("from_nominal_deg_"))
            warnings.append(
                f"the sensor on the {on} is turned by {value:.0f} deg against the way it should be worn, or "
                f"the arm was not in the pose: look that it sits on the {on}, the right way round, take the "
                "pose exactly, and calibrate again"
            )
    return tuple(warnings)


def _forward(segments: Collection[str], assumed: Collection[str]) -> str:
    turned = "planes of movement and shoulder rotation are relative to it"
    if not any(part_of(s) == "upper_arm" for s in segments):
        turned = "where it points seen from the trunk is relative to it"
    if assumed:
        turned = f"the heading of {_listed(assumed)} against the trunk is assumed, and {turned}"
    return (
        f"no rule says where forward is: {turned}; inclinations hold; "
        "give facing_deg (with magnetometers), or the nominal mounting of a sternum or upper-arm sensor"
    )


def _loose(segments: Collection[str], assumed: Collection[str], tied: Sequence[Collection[str]]) -> list[str]:
    """Return a line for each kind of joint between whose sensors nothing tells the heading."""
    found: dict[str, tuple[dict[str, None], dict[str, None]]] = {}
    for side in SIDES:
        chain = [s for s in ("sternum", *arm_segments(side)) if s in segments]
        for near, far in pairwise(chain):
            known = near not in assumed and far not in assumed
            if known or any(near in group and far in group for group in tied):
                continue
            doubtful, other = (far, near) if far in assumed else (near, far)
            between = BETWEEN.get((part_of(near), part_of(far)), "directions of one seen from the other")
            doubtfuls, others = found.setdefault(between, ({}, {}))
            doubtfuls[doubtful], others[other] = None, None
    return [
        f"heading of {_listed(doubtfuls)} is assumed against {_listed(others)}: neither magnetometers nor a "
        f"nominal mounting nor movement ties them, so {between} can be far off and even have the wrong sign; "
        f"{ELBOW_TO_DO if between.startswith('elbow') else TO_DO}"
        for between, (doubtfuls, others) in found.items()
    ]


def _listed(segments: Collection[str]) -> str:
    *rest, last = sorted(segments)
    return f"{', '.join(rest)} and {last}" if rest else last
