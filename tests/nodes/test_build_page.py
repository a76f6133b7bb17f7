"""docs/build-a-wearable.md: its configuration is taken, and its commands up to the flashing run."""

import importlib.util
import json
import os
import re
import shlex
import subprocess
import sys
import tomllib
from pathlib import Path
from xml.etree import ElementTree

import pytest

from brachium_nodes.firmware_build import micropython
from brachium_nodes.run_time import run_times

PAGE = Path(__file__).parents[2] / "docs" / "build-a-wearable.md"
pytestmark = pytest.mark.skipif(not PAGE.is_file(), reason="no source tree: the wheel is tested")


def block(after: str, language: str) -> str:
    found = re.search(rf"{re.escape(after)}.*?```{language}\n(.*?)```", PAGE.read_text("utf-8"), re.DOTALL)
    assert found is not None
    return found.group(1)


def test_the_files_to_flash_are_made_and_take_the_pages_configuration(firmware, tmp_path: Path):
    (line,) = (line for line in block("## Flashing", "sh").splitlines() if line.startswith("brachium "))
    words = [sys.executable, "-m", *line.split()]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    done = subprocess.run(words, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    made = {path.name: path.read_bytes() for path in (tmp_path / "flash").iterdir()}
    assert made == {path.name: path.read_bytes() for path in firmware.firmware.iterdir()}
    assert set(done.stdout.split()) == {f"flash/{name}" for name in made}
    (tmp_path / "brachium.json").write_text(block("example: brachium.json", "json"))
    code = (
        "import sys, json",
        "sys.path.insert(0, 'flash')",
        "import configuration as c",
        "print(json.dumps(c.load()))",
    )
    (tmp_path / "look.py").write_text("\n".join(code))
    seen = subprocess.run(
        [*micropython(), "look.py"], cwd=tmp_path, capture_output=True, text=True, check=True
    )
    taken = json.loads(seen.stdout)
    assert taken["battery"]["full_scale_v"] == 5.0
    page = PAGE.read_text("utf-8")
    for name in ("poll_ms", "queue_s", "longest_pause_s"):
        assert f"| `{name}` | {taken[name]} |" in page
    assert f"| `rate_hz`, `batch` | {taken['rate_hz']}, {taken['batch']} |" in page


def test_the_pages_first_line_installs_what_this_package_offers():
    (line,) = (line for line in block("## Flashing", "sh").splitlines() if line.startswith("pip "))
    words = shlex.split(line)
    offered = tomllib.loads((PAGE.parents[1] / "pyproject.toml").read_text("utf-8"))["project"]
    assert words[:2] == ["pip", "install"]
    assert words[2] in {f"{offered['name']}[{extra}]" for extra in offered["optional-dependencies"]}
    assert words[3:] == ["esptool", "mpremote"]


@pytest.mark.parametrize("tool", ["esptool", "mpremote"])
def test_the_flashing_tool_knows_the_pages_commands(tool: str):
    lines = [line for line in block("**the cell taken out**:", "").splitlines() if line.startswith(tool)]
    assert lines
    if importlib.util.find_spec(tool) is None:
        pytest.skip(f"{tool} is not installed: it is the builder's, and under a licence of its own")
    for line in lines:
        _tool, option, port, *words = shlex.split(line)
        assert (option, port) in {("--port", "/dev/ttyUSB0"), ("connect", "/dev/ttyUSB0")}
        asked = [words[0], "--help"] if tool == "esptool" else ["help"]
        done = subprocess.run(
            [sys.executable, "-m", tool, *asked], capture_output=True, text=True, check=False
        )
        assert done.returncode == 0, done.stdout + done.stderr
        assert words[0] in done.stdout


def test_the_pages_run_times_are_the_commands():
    rows = re.findall(r"^\| (ESP[^|]*) \|(.*)\|$", PAGE.read_text("utf-8"), re.MULTILINE)
    said = [(parts, *(float(cell) for cell in cells.split("|"))) for parts, cells in rows]
    assert said == [
        (
            one.parts, one.rate_hz, one.listening_ma, one.sending_ma, one.computing_ma, one.sensor_ma,
            one.board_ma, one.reserve_ma, one.total_ma, one.hours,
        )
        for one in run_times()
    ]  # fmt: skip


def test_the_parts_cost_what_the_page_promises():
    table = block_of_parts()
    costs = {
        name: int(cost) for name, cost in re.findall(r"^\| ([^|]*) \| \**(\d+)\** \|", table, re.MULTILINE)
    }
    total = costs.pop("**sum**")
    assert sum(costs.values()) == total <= 20
    assert len(costs) >= 5


def block_of_parts() -> str:
    found = re.search(r"## Parts\n(.*?)\n## ", PAGE.read_text("utf-8"), re.DOTALL)
    assert found is not None
    return found.group(1)


def test_the_pages_drawing_shows_every_node():
    text = PAGE.read_text("utf-8")
    (name,) = re.findall(r"!\[[^]]*\]\((pictures/[^)]+\.svg)\)", text)
    drawing = ElementTree.parse(PAGE.parent / name)
    words = " ".join(drawing.getroot().itertext())
    for node in ("Sternum", "Upper arm", "Forearm", "Hand", "Y along the limb"):
        assert node in words
