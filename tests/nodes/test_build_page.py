"""docs/build-a-wearable.md: its configuration is taken, and its commands up to the flashing run."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from brachium_nodes.firmware_build import micropython

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


def test_run_times_are_capacity_over_current():
    text = PAGE.read_text("utf-8")
    said = re.search(
        r"At (\d+) mAh and an assumed (\d+) mA .*? ([\d.]+) hours, at an assumed (\d+) mA .*? ([\d.]+)\.",
        text,
    )
    assert said is not None
    capacity, slow, slow_hours, fast, fast_hours = map(float, said.groups())
    assert slow_hours == pytest.approx(capacity / slow, abs=0.06)
    assert fast_hours == pytest.approx(capacity / fast, abs=0.06)
