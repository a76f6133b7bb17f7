"""The house's rules, held by a test: who may import whom, where keys are made, how large a file may be."""

import ast
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PARTS = {
    "body": "brachium_body",
    "wire": "brachium_wire",
    "nodes": "brachium_nodes",
    "router": "brachium_router",
    "fusion": "brachium_fusion",
    "viewer": "brachium_viewer",
    "deploy": "brachium",
}
MICROPYTHON = ("brachium_nodes.firmware.", "brachium_nodes.simulated_board.")
"""Data: programs of another language, which the firmware's tests run."""
LARGEST_LINES = 250
LARGER = {
    "brachium_wire.bus": 380,  # the one module that knows Zenoh: all of it in one place
    "brachium_wire.messages": 280,  # one record after the other, each field with its words
    "brachium_fusion.subject": 339,  # what is known of one subject, and all that may change it, in one order
    "brachium_fusion.pose": 260,  # forward and mounting are found together, from the same samples
}
"""Modules that are larger than a file should be, and how large at most: a limit here may only fall."""

pytestmark = pytest.mark.skipif(
    not all((ROOT / part).is_dir() for part in PARTS),
    reason="no source tree: the wheel is tested",
)


def modules() -> Iterator[tuple[str, Path]]:
    """Yield every module of ours and its file."""
    for part in PARTS:
        for path in sorted((ROOT / part).rglob("*.py")):
            yield (
                ".".join(path.relative_to(ROOT / part).with_suffix("").parts).removesuffix(".__init__"),
                path,
            )


def test_imports_run_one_way():
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(str(ROOT / part) for part in PARTS)}
    command = [sys.executable, "-c", "from importlinter.cli import lint_imports_command as c; c()"]
    done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert re.search(r"[2-9] kept, 0 broken", done.stdout)


@pytest.mark.parametrize("part", PARTS)
def test_each_part_holds_its_one_typed_package(part: str):
    packages = [path.parent.name for path in (ROOT / part).glob("*/__init__.py")]
    assert packages == [PARTS[part]]
    assert (ROOT / part / PARTS[part] / "py.typed").is_file()


def test_keys_are_made_in_one_place():
    found = []
    for name, path in modules():
        if name == "brachium_wire.keys":
            continue
        tree = ast.parse(path.read_text("utf-8"))
        prose = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}  # docstrings
        for node in ast.walk(tree):
            if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in prose:
                found += [f"{name}:{node.lineno}"] if node.value.startswith("brachium/") else []
    assert found == []


def test_files_are_small():
    too_large = {}
    for name, path in modules():
        lines = len(path.read_text("utf-8").splitlines())
        if lines > LARGER.get(name, LARGEST_LINES):
            too_large[name] = lines
    assert too_large == {}


def test_only_files_that_need_it_may_be_larger():
    lines = {name: len(path.read_text("utf-8").splitlines()) for name, path in modules()}
    assert {name: lines.get(name) for name in LARGER if lines.get(name, 0) <= LARGEST_LINES} == {}


def test_only_the_bus_knows_zenoh():
    allowed = {"brachium_wire.bus", "brachium_router.service", "brachium.bench_relay"}
    assert {name for name, path in modules() if "zenoh" in imported(path)} <= allowed


def imported(path: Path) -> set[str]:
    """Return what a file imports, anywhere in it: modules, and names that may be modules."""
    names = set()
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            names |= {node.module, *(f"{node.module}.{alias.name}" for alias in node.names)}
    return names


def test_every_module_is_reached_by_a_test():
    files = {name: path for name, path in modules() if not name.startswith(MICROPYTHON)}
    todo = set().union(*(imported(path) for path in (ROOT / "tests").rglob("*.py"))) & set(files)
    # Commands are tested by their names; the others are fetched by name, or run as programs.
    todo |= {name for name in files if name.startswith("brachium.commands.")}
    todo |= {"brachium.client", "brachium.bench_relay", "brachium.bench_crowd", "brachium.bench_echo"}
    reached: set[str] = set()
    while todo:
        name = todo.pop()
        reached.add(name)
        own = {n for n in imported(files[name]) & set(files) if n.split(".")[0] == name.split(".")[0]}
        todo |= own - reached
    assert sorted(set(files) - reached - set(PARTS.values()) - {"brachium.commands"}) == []


def test_no_file_speaks_of_the_place_it_was_written_at():
    words = re.compile("|".join(("/wo" + "rk/", "/tm" + "p/v/", r"\bC" + r"EO\b", r"issue " + r"#?\d")))
    found = []
    for folder in (*PARTS, "tests", "docs", "bench", ".ci"):
        for path in (ROOT / folder).rglob("*"):
            if path.suffix in {".py", ".md", ".toml", ".html", ".j2", ".css", ".js", ""} and path.is_file():
                text = path.read_text("utf-8", "replace")
                found += [f"{path.relative_to(ROOT)}: {match.group()}" for match in words.finditer(text)]
    assert found == []


@pytest.mark.parametrize("lock", ["demo", "dev"])
def test_locks_name_hashes_and_no_index(lock: str):
    text = (ROOT / "requirements" / f"{lock}.txt").read_text("utf-8")
    requirements = re.findall(r"^[A-Za-z0-9._-]+(?:\[[a-z,]+\])?==\S+", text, re.MULTILINE)
    assert len(requirements) > 20
    assert "://" not in text
    assert "--index" not in text
    assert "--find-links" not in text
    for block in re.split(r"\n(?=[A-Za-z0-9])", text):
        assert "==" not in block or "--hash=sha256:" in block, block.splitlines()[0]
