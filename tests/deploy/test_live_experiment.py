"""Own node and Shimmer3 on one emulated forearm at once, each by its own way in, compared by one command."""

import json

import pytest

pytestmark = pytest.mark.network

DELAY_S = 0.06


@pytest.fixture(scope="module")
def experiment(brachium):
    words = ["compare", "--live", "p01", "p01.ref", "--emulate", "--seconds", "9"]
    done = brachium(*words, "--shimmer-delay", str(DELAY_S), "--json", timeout_s=120.0)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def test_the_offset_of_the_clocks_is_the_one_that_was_put_there(experiment):
    clock = experiment["found"]["clock"]
    # Nothing comes sooner than the delay; the port is looked at every few ms, and the machine is busy.
    assert DELAY_S - 0.003 - clock["margin_s"] < clock["offset_s"] < DELAY_S + 0.02 + clock["margin_s"]
    assert 0.0 < clock["margin_s"] < 0.005
    assert clock["correlation"] > 0.99


def test_what_the_clocks_are_said_to_be_is_stated_beside(experiment):
    hosts = experiment["hosts"]
    assert abs(hosts["apart_s"]) <= hosts["margin_s"] + 1e-3
    assert hosts["stated_s"]["p01"] < 0.02  # questions and answers
    assert hosts["stated_s"]["p01.ref"] >= 0.05  # arrivals alone
    assert experiment["found"]["clock"]["offset_s"] < sum(hosts["stated_s"].values()) + 0.02


def test_table_4_is_there_and_no_better_than_the_truth(experiment):
    found = experiment["found"]
    assert found["rows"] > 300
    for way in ("as_worn", "aligned"):
        assert set(found[way]["places"]) == {"wrist", "hand"}
        for place in found[way]["places"].values():
            assert place["eq17"]["mae"] <= place["eq17"]["rmse"] <= place["apart"]["rmse"]
            assert set(place["axes"]) == {"x", "y", "z"}
    truth = found["truth"]
    for joint in ("wrist", "hand"):
        worst = sum(truth[who][joint]["max_abs"] for who in "ab")
        assert found["as_worn"]["places"][joint]["apart"]["max_abs"] <= worst + 1e-3
        assert truth["a"][joint]["rmse"] < 0.03
        assert truth["b"][joint]["rmse"] < 0.03
        aligned = found["aligned"]["places"][joint]["apart"]["rmse"]
        assert aligned < found["as_worn"]["places"][joint]["apart"]["rmse"]


def test_who_was_compared_is_said(experiment):
    assert experiment["chips"] == {"p01": "MPU-9150 (emulated)", "p01.ref": "shimmer3"}
    assert experiment["origin"] == "emulated"
    assert experiment["exercise"] == "elbow-flexion"
    assert set(experiment["found"]["removed"]) == {"forearm_r"}
    assert experiment["drops"] == {}


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["p01", "p01"], "cannot be compared with itself"),
        (["p01", "p02", "--emulate"], "second sensor is p01.ref"),
        (["p01", "no/name"], "cannot be used"),
        (["p01", "p01.ref", "--emulate", "--exercise", "flying"], "flying"),
    ],
)
def test_bad_input_is_said_before_anything_starts(brachium, words, said):
    done = brachium("compare", "--live", *words)
    assert done.returncode == 2
    assert said in done.stderr
    assert "Traceback" not in done.stderr
