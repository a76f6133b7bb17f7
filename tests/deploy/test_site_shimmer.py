"""A Shimmer3 in a site file: a service of its own for each."""

from pathlib import Path

import pytest

from brachium import site_file
from brachium.site_file import BadSite, parse
from brachium.site_services import services

SITE = """
[room]
id = "gym"
services = ["router", "fuse"]
[[subject]]
id = "p01.ref"
[[shimmer]]
port = "/dev/rfcomm0"
subject = "p01.ref"
segment = "forearm_r"
mounting = [-1, 0, 0, 0]
[[shimmer]]
port = "/dev/rfcomm1"
subject = "p01.ref"
segment = "upper_arm_r"
"""


def started(text):
    found = services(parse(text), Path("/x/gym.toml"), join_token="t", users_file=None)
    return {service.name: service.words for service in found}


def test_each_shimmer_is_a_service():
    found = started(SITE)
    assert list(found) == ["router", "fuse", "shimmer-p01.ref-forearm_r", "shimmer-p01.ref-upper_arm_r"]
    words = found["shimmer-p01.ref-forearm_r"]
    assert words[0] == "shimmer"
    assert words[words.index("--room") + 1] == "gym"
    assert words[words.index("--port") + 1] == "/dev/rfcomm0"
    assert words[words.index("--segment") + 1] == "forearm_r"
    assert words[-1] == "--mounting=-1.0,0.0,0.0,0.0"
    assert not any(word.startswith("--mounting") for word in found["shimmer-p01.ref-upper_arm_r"])


def test_its_words_are_options_of_the_command():
    import argparse

    from brachium.commands import shimmer

    parser = argparse.ArgumentParser()
    shimmer.configure(parser)
    for name, words in started(SITE).items():
        if name.startswith("shimmer"):
            parser.parse_args(words[1:])


def test_the_shipped_experiment_wears_both_on_one_segment():
    site = site_file.read(site_file.find("experiment.toml"))
    assert [n.segment for n in site.node] == [s.segment for s in site.shimmer] == ["forearm_r"]
    assert [n.subject for n in site.node] == ["p01"]
    assert [s.subject for s in site.shimmer] == ["p01.ref"]


@pytest.mark.parametrize(
    ("before", "after", "said"),
    [
        (
            'subject = "p01.ref"\nsegment = "forearm_r"',
            'subject = "p02"\nsegment = "forearm_r"',
            "no .*subject",
        ),
        ("/dev/rfcomm1", "/dev/rfcomm0", "there twice"),
        ("upper_arm_r", "forearm_r", "there twice"),
        ('port = "/dev/rfcomm0"', 'prt = "/dev/rfcomm0"', "did you mean 'port'"),
        ('segment = "upper_arm_r"', 'segment = "leg"', "leg"),
    ],
)
def test_what_cannot_be_is_refused_by_name(before, after, said):
    with pytest.raises(BadSite, match=said):
        parse(SITE.replace(before, after, 1))
