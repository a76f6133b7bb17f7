from pathlib import Path

import pytest

from brachium import site_file
from brachium.secrets_store import load_or_make, write_users
from brachium.site_file import SERVICES, BadSite, parse
from brachium.site_services import endpoint, services, session, wants_password

NODE = f'[[node]]\nid = "n1"\ntoken_sha256 = "{"0" * 64}"\n'
WHOLE = """
[room]
id = "gym"
bind = "192.0.2.7"
ports = { router = 7001, gateway = 7002, web = 7003 }
services = ["router", "gateway", "slimevr", "fuse", "record", "web", "view"]
[[subject]]
id = "p01"
side = "left"
height_m = 1.80
[[node]]
id = "esp-3f21"
token_sha256 = "abababababababababababababababababababababababababababababababab"
subject = "p01"
segment = "forearm_l"
mounting = [1, 0, 0, 0]
[[tracker]]
mac = "a1:b2:c3:d4:e5:f6"
sensor = 1
subject = "p01"
segment = "hand_l"
"""


def test_the_shipped_site_is_read_by_its_name_alone():
    site = site_file.read(site_file.find("lan.toml"))
    assert site.room.bind == "127.0.0.1"
    assert not wants_password(site)


def test_a_file_of_ones_own_goes_before_the_shipped_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    (tmp_path / "lan.toml").write_text('[room]\nid = "mine"\n')
    monkeypatch.chdir(tmp_path)
    assert site_file.read(site_file.find("lan.toml")).room.id == "mine"


def test_a_whole_site_becomes_its_services():
    site = parse(WHOLE)
    found = {
        s.name: s.words for s in services(site, Path("/x/gym.toml"), join_token="t", users_file=Path("/u"))
    }
    assert list(found) == list(SERVICES)
    assert all(words[words.index("--room") + 1] == "gym" for words in found.values())
    others = [found[name] for name in found if name != "router"]
    assert all(words[words.index("--endpoint") + 1] == "tcp/192.0.2.7:7001" for words in others)
    assert found["router"][-2:] == ["--users", "/u"]
    assert "t" not in found["gateway"], "a token must not be seen in the list of processes"
    assert found["slimevr"][-4:] == ["--bind", "192.0.2.7", "--site", "/x/gym.toml"]
    assert session(site.subject[0]).side == "left"


@pytest.mark.parametrize(
    ("room", "expected"),
    [
        ('bind = "127.0.0.1"', False),
        ('bind = "::1"', False),
        ('bind = "192.0.2.7"', True),
        ('bind = "192.0.2.7"\npassword = false', False),
        ('bind = "127.0.0.1"\npassword = true', True),
    ],
)
def test_beyond_loopback_a_password_is_asked_for(room: str, expected: bool):
    assert wants_password(parse(f'[room]\nid = "a"\n{room}')) is expected


def test_an_ipv6_endpoint_is_bracketed():
    assert endpoint(parse('[room]\nid = "a"\nbind = "::1"')) == "tcp/[::1]:7447"


BAD = {
    "table misspelt": ('[rooms]\nid = "a"', "'rooms' is not known; did you mean 'room'?"),
    "key misspelt": ('[room]\nid = "a"\nbnd = "127.0.0.1"', "room: 'bnd' is not known; did you mean 'bind'?"),
    "inner key misspelt": ('[room]\nid = "a"\nports = { gatway = 1 }', "did you mean 'gateway'?"),
    "node key misspelt": (f'[room]\nid = "a"\n{NODE}segmnt = "hand_r"', "did you mean 'segment'?"),
    "no room": ("", "room"),
    "not TOML": ("room =", "not TOML"),
    "room of two words": ('[room]\nid = "a b"', "room 'a b'"),
    "reserved subject": ('[room]\nid = "a"\n[[subject]]\nid = "service"', "'service'"),
    "wrong type": ('[room]\nid = "a"\nports = { router = "x" }', "$.room.ports.router"),
    "unknown segment": (f'[room]\nid = "a"\n{NODE}segment = "head"\nsubject = "p"', "'head'"),
    "unknown service": ('[room]\nid = "a"\nservices = ["rooter"]', "'rooter'"),
    "segment without subject": (f'[room]\nid = "a"\n{NODE}segment = "hand_r"', "both subject and segment"),
    "unknown subject": (
        f'[room]\nid = "a"\n{NODE}segment = "hand_r"\nsubject = "p"',
        "which no [[subject]] has",
    ),
    "node twice": (f'[room]\nid = "a"\n{NODE}{NODE}', "node 'n1' is there twice"),
    "ports equal": ('[room]\nid = "a"\nports = { router = 7001, gateway = 7001 }', "a port of its own"),
    "every interface": ('[room]\nid = "a"\nbind = "0.0.0.0"', "every interface"),
    "every IPv6 interface": ('[room]\nid = "a"\nbind = "::"', "every interface"),
    "no hash": (f'[room]\nid = "a"\n{NODE.replace("0" * 64, "zz")}', "64 digits"),
    "port outside": ('[room]\nid = "a"\nports = { router = 99999 }', "65535"),
}


@pytest.mark.parametrize("case", BAD)
def test_a_bad_site_is_refused_by_name(case: str):
    text, expected = BAD[case]
    with pytest.raises(BadSite) as error:
        parse(text)
    assert expected in str(error.value)
    assert "\n" not in str(error.value)


def test_two_nodes_for_one_place_are_refused():
    place = 'subject = "p"\nsegment = "hand_r"\n'
    text = f'[room]\nid = "a"\n[[subject]]\nid = "p"\n{NODE}{place}{NODE.replace("n1", "n2")}{place}'
    with pytest.raises(BadSite, match="hand_r of p"):
        parse(text)


@pytest.mark.parametrize(
    ("tracker", "says"),
    [
        ('mac = "a1b2c3d4e5f6"\nsubject = "p01"\nsegment = "hand_l"', "is there twice"),
        ('mac = "a1b2c3d4e5f6"\nsubject = "p02"\nsegment = "hand_l"', "which no [[subject]] has"),
        ('mac = "a1b2c3d4e5f6"\nsubject = "p01"\nsegment = "elbow"', "elbow"),
        ('mac = "a1b2c3d4e5f6"\nsubjekt = "p01"', "did you mean 'subject'"),
    ],
)
def test_a_tracker_that_cannot_be_is_refused_by_name(tracker: str, says: str):
    with pytest.raises(BadSite) as told:
        parse(f"{WHOLE}[[tracker]]\n{tracker}\n")
    assert says in str(told.value)


def test_secrets_are_made_once_and_for_this_user_only(tmp_path: Path):
    folder = tmp_path / "state" / "gym"
    made = load_or_make(folder)
    assert load_or_make(folder) == made
    assert made.password != made.join_token
    users = write_users(folder, "room", made.password)
    assert users.read_text() == f"room:{made.password}\n"
    for path in (folder / "secrets.json", users):
        assert path.stat().st_mode & 0o077 == 0


def test_foreign_secrets_are_refused_and_kept(tmp_path: Path):
    (tmp_path / "secrets.json").write_text("[]")
    with pytest.raises(ValueError, match="delete it"):
        load_or_make(tmp_path)
    assert (tmp_path / "secrets.json").read_text() == "[]"
