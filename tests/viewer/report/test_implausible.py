"""What no joint does is told before anything else of a report, in its language."""

import numpy as np

from brachium_viewer.catalogue import catalogue
from brachium_viewer.contents import load
from brachium_viewer.report.implausible import implausible
from brachium_viewer.sessions import from_recording


def motions(path):
    return from_recording.motions(load(path), "p01")


def test_what_a_joint_can_do_is_not_told_of(worn):
    assert implausible(motions(worn)) == []


def test_an_elbow_that_bends_beyond_its_range_is_told_with_how_often(impossible):
    found = motions(impossible)
    (line,) = [one for one in implausible(found) if one.startswith("elbow flexion, right")]
    angle = found["right"].known("elbow_flexion")
    share = 100.0 * np.nanmean(angle[np.isfinite(angle)] > 160.0)
    assert line.startswith(f"elbow flexion, right: {share:.0f} % of its values are beyond -15 to 160 deg")
    told = catalogue("de").told(line)
    assert told.startswith("Ellbogenbeugung, ")
    assert "außerhalb von" in told


def test_a_knock_is_not_told_of(worn):
    found = motions(worn)
    angle = found["right"].angles_deg["elbow_flexion"]
    angle[: len(angle) // 150] = 170.0
    assert implausible(found) == []
    angle[: len(angle) // 50] = 170.0
    assert [line.split(":")[0] for line in implausible(found)] == ["elbow flexion, right"]
