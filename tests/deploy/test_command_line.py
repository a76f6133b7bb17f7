import argparse
import os
import re
import shlex
import subprocess
import sys
from dataclasses import fields
from importlib import import_module
from pathlib import Path

import pytest

from brachium.__main__ import COMMANDS, main
from brachium.commands import fuse
from brachium_fusion.orientation import FILTERS
from brachium_fusion.service import FuseSettings
from brachium_nodes.emulate import EmulateSettings
from brachium_nodes.gateway import GatewaySettings
from brachium_nodes.play import PlaySettings
from brachium_router.config import RouterSettings
from brachium_viewer.live import ViewSettings
from brachium_viewer.monitor import MonitorSettings
from brachium_viewer.recorder import RecordSettings
from brachium_wire.keys import DEFAULT_ROOM

HEAVY = (
    "numpy",
    "zenoh",
    "scipy",
    "rerun",
    "msgspec",
    "msgpack",
    "websockets",
    "matplotlib",
    "pyarrow",
    "asyncio",
)


def test_help_loads_nothing_heavy():
    """The promise is an answer within 0.3 s; what keeps it is that only the table is read."""
    code = (
        "import sys\nfrom brachium.__main__ import main\nassert main(['--help']) == 0\n"
        f"sys.exit(sorted(set({HEAVY}) & set(sys.modules)) or 0)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert all(f"  {name} " in done.stdout for name in COMMANDS)


def test_importing_brachium_loads_nothing_heavy():
    code = f"import sys, brachium\nsys.exit(sorted(set({HEAVY}) & set(sys.modules)) or 0)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("service", ["brachium_nodes.emulate", "brachium_fusion.service"])
def test_a_service_starts_without_what_takes_longest_to_import(service: str):
    code = f"import sys, {service}\nsys.exit('scipy.signal' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("name", COMMANDS)
def test_each_command_explains_itself_with_an_example(name: str, capsys: pytest.CaptureFixture[str]):
    with pytest.raises(SystemExit) as ended:
        main([name, "--help"])
    assert ended.value.code == 0
    said = capsys.readouterr().out
    assert f"usage: brachium {name}" in said
    assert "default: []" not in said
    example = said.split("example:\n")[1]
    assert f"brachium {name} " in example or f"brachium {name}\n" in example


@pytest.mark.parametrize("name", COMMANDS)
def test_examples_have_options_that_are_there(name: str):
    module = import_module(f"brachium.commands.{name.replace('-', '_')}")
    lines = re.findall(rf"^ *brachium {name}\b(.*)$", module.__doc__ or "", re.MULTILINE)
    assert lines
    for line in lines:
        parser = argparse.ArgumentParser(exit_on_error=False)
        module.configure(parser)
        parser.parse_args(shlex.split(line.split(">")[0]))


@pytest.mark.parametrize(
    "settings",
    [
        RouterSettings,
        GatewaySettings,
        EmulateSettings,
        PlaySettings,
        FuseSettings,
        ViewSettings,
        RecordSettings,
        MonitorSettings,
    ],
)
def test_all_programs_meet_in_one_room(settings: type):
    assert [f.default for f in fields(settings) if f.name == "room"] == [DEFAULT_ROOM]


def test_the_filters_offered_are_those_of_fusion():
    assert fuse.FILTERS == FILTERS


@pytest.mark.parametrize("name", COMMANDS)
def test_an_unknown_option_is_usage(name: str, capsys: pytest.CaptureFixture[str]):
    with pytest.raises(SystemExit) as ended:
        main([name, "--no-such-option"])
    assert ended.value.code == 2
    assert capsys.readouterr().err


def test_an_unknown_command_names_the_nearest(capsys: pytest.CaptureFixture[str]):
    assert main(["rooter"]) == 2
    assert capsys.readouterr().err == "brachium: no command 'rooter'; did you mean 'router'?\n"
    assert main(["xyzzy"]) == 2
    assert "brachium --help" in capsys.readouterr().err


def test_the_version_is_the_distributions(brachium):
    done = brachium("--version")
    assert done.returncode == 0
    assert done.stdout.startswith(("brachium 0.", "brachium, from"))


BAD_INPUT = {
    "all interfaces": (["router", "--bind", "0.0.0.0"], "every interface"),
    "pages everywhere": (["web", "--bind", "0.0.0.0"], "one interface"),
    "pages nowhere": (["web", "--bind", "nonsense"], "'nonsense' is no address"),
    "no such interface": (["slimevr", "--bind", "nohost"], "'nohost' is no address"),
    "port outside": (["router", "--port", "99999"], "65535"),
    "no such input": (["solve", "nothing.mcap"], "nothing.mcap"),
    "foreign file": (["solve", __file__], "not a recording"),
    "unknown orientation filter": (["fuse", "--filter", "magic"], "choose from"),
    "unknown filter": (["solve", "nothing.mcap", "--filter", "magic"], "choose one of"),
    "no such site": (["up", "nothing.toml"], "nothing.toml"),
    "foreign site": (["up", __file__], "not TOML"),
    "assign without a place": (["gateway", "--assign", "esp-1"], "ID=SUBJECT/SEGMENT"),
    "assign with a wildcard": (["gateway", "--assign", "esp-1=p01/*"], "segment '*'"),
    "assign to no segment": (["gateway", "--assign", "stranger=p01/thigh"], "forearm_r"),
    "subject outside": (["record", "--subject", "../../evil"], "cannot be used"),
    "endpoint misspelt": (["monitor", "--endpoint", "foo"], "tcp/<host>:<port>"),
    "room of two words": (["fuse", "--room", "my room"], "room 'my room'"),
    "unknown exercise": (["emulate", "--exercise", "flying"], "choose one of elbow-flexion"),
    "unknown mistake": (["emulate", "--exercise", "sensor-calibration-slow"], "sensor-calibration-iron"),
    "unknown routine": (["emulate", "--routine", "dancing"], "choose one of calibration"),
    "nothing to play": (["play", "nothing"], "nothing"),
    "nothing to compare": (["compare", "a.csv", "b.csv"], "a.csv"),
}


BAD_NUMBERS = {
    "fuse": {"--rate": ("0", "-1", "nan", "inf", "x")},
    "web": {"--port": ("99999", "-1", "x"), "--subject": ("../x",)},
    "view": {"--web-port": ("99999", "-1", "x"), "--grpc-port": ("99999",), "--subject": ("../x",)},
    "play": {"--speed": ("nan", "0", "-1", "inf"), "--seconds": ("nan", "-1", "0")},
    "emulate": {
        "--seconds": ("nan", "-3"),
        "--seed": ("-1",),
        "--wearers": ("0",),
        "--batch": ("0", "-1"),
        "--rate": ("nan", "0"),
        "--loss": ("2", "nan"),
        "--swap": ("-1",),
        "--duplicate": ("inf",),
    },
    "demo": {"--seconds": ("nan", "-1", "0"), "--seed": ("-1",), "--loss": ("nan",)},
    "record": {"--seconds": ("nan", "-1", "inf")},
    "monitor": {"--seconds": ("nan", "0")},
    "gateway": {"--port": ("-1", "99999"), "--join-token-sha256": ("zz",)},
    "router": {"--port": ("0", "x"), "--max-sessions": ("0",)},
    "bench": {"--arms": ("-1",)},
    "solve": {"--rate": ("nan", "0")},
    "wear-check": {"--hang": ("nan:2", "3:1", "4", "1:1.5"), "--bend": ("x:y",)},
    "compare": {"--from": ("nan",), "--to": ("inf",)},
}


@pytest.mark.parametrize(
    ("name", "option", "value"),
    [(n, o, v) for n, options in BAD_NUMBERS.items() for o, values in options.items() for v in values],
)
def test_a_number_out_of_range_is_usage(
    name: str, option: str, value: str, capsys: pytest.CaptureFixture[str]
):
    places = {"play": ["x"], "solve": ["x"], "compare": ["a", "b"]}.get(name, [])
    try:
        code = main([name, *places, f"{option}={value}"])
    except SystemExit as ended:
        code = int(str(ended.code))
    assert code == 2
    said = capsys.readouterr().err
    assert "cannot be used" in said
    assert repr(value) in said


@pytest.mark.parametrize(
    "words",
    [
        ["record", "--out"],
        ["web", "--sessions"],
        ["demo", "--out"],
        ["firmware", "--out"],
        ["sensor", "x", "--out"],
        ["prove", "--out"],
    ],
    ids=lambda words: words[0],
)
@pytest.mark.parametrize("inside", ["", "inside"])
def test_a_file_where_a_folder_goes_is_named(
    words: list[str], inside: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    (tmp_path / "afile").touch()
    with pytest.raises(SystemExit, match="2"):
        main([*words, str(tmp_path / "afile" / inside)])
    assert f"{tmp_path / 'afile'} is a file, and a folder goes there" in capsys.readouterr().err


def test_pages_do_not_start_over_a_store_that_can_keep_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    (tmp_path / "sessions.sqlite").write_text("no database" * 100)
    assert main(["web", "--sessions", str(tmp_path)]) == 2
    assert "no store of sessions" in capsys.readouterr().err


def only_line(command: str, stderr: str) -> str:
    """Return the one line that a command says of its bad input."""
    assert "Traceback" not in stderr
    (said,) = [line for line in stderr.splitlines() if line.startswith(f"brachium {command}: ")]
    return said


@pytest.mark.parametrize("case", BAD_INPUT)
def test_bad_input_is_one_line_and_code_2(case: str, capsys: pytest.CaptureFixture[str]):
    words, expected = BAD_INPUT[case]
    try:
        code = main([*words])
    except SystemExit as ended:
        code = ended.code
    assert code == 2
    assert expected in only_line(words[0], capsys.readouterr().err)


@pytest.mark.parametrize("case", ["unknown filter", "no such input"])  # one the parser's, one the command's
def test_a_process_ends_with_that_code(case: str, brachium):
    words, expected = BAD_INPUT[case]
    done = brachium(*words)
    assert done.returncode == 2, done.stderr
    assert expected in only_line(words[0], done.stderr)


def test_a_missing_extra_is_one_line_that_names_it(brachium, tmp_path, monkeypatch):
    (tmp_path / "sitecustomize.py").write_text("import sys\nsys.modules['pyarrow'] = None\n")
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(tmp_path), os.environ.get("PYTHONPATH", "")]))
    capture = tmp_path / "capture"
    capture.mkdir()
    (capture / "forearm_r.parquet").write_bytes(b"PAR1")
    done = brachium("solve", str(capture))
    assert done.returncode == 1
    assert "pip install 'brachium[parquet]'" in done.stderr
    assert "Traceback" not in done.stderr
