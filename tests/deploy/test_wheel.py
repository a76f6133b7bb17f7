"""What is shipped: the wheel alone, away from the tree, has all that the tree has and runs a demo."""

import json
import os
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PARTS = ("body", "wire", "nodes", "router", "fusion", "viewer", "deploy")

pytestmark = pytest.mark.skipif(
    not (ROOT / "deploy").is_dir(), reason="the source tree is not here: nothing to build"
)


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("dist")
    command = [sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", str(folder), str(ROOT)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    (built,) = folder.glob("brachium-*.whl")
    return built


@pytest.fixture(scope="module")
def installed(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("site")
    command = [
        sys.executable,
        "-m",
        "pip",
        "install",
        "--no-deps",
        "--no-index",
        "-q",
        "--target",
        str(folder),
    ]
    done = subprocess.run([*command, str(wheel)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return folder


def run(installed: Path, cwd: Path, *words: str) -> subprocess.CompletedProcess[str]:
    """Run Python where only the wheel's packages are found."""
    environment = {**os.environ, "PYTHONPATH": str(installed)}
    return subprocess.run(
        [sys.executable, *words],
        cwd=cwd,
        env=environment,
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )


def test_the_wheel_holds_every_file_of_the_tree(wheel: Path):
    tree = set()
    for part in PARTS:
        for path in (ROOT / part).rglob("*"):
            if path.is_file() and path.suffix != ".pyc":
                tree.add(path.relative_to(ROOT / part).as_posix())
    with zipfile.ZipFile(wheel) as archive:
        names = {name for name in archive.namelist() if ".dist-info/" not in name}
    assert names == tree
    assert {"brachium/site/lan.toml", "brachium/py.typed", "brachium_wire/py.typed"} <= names


def test_every_module_of_the_wheel_imports_and_comes_from_it(installed: Path, tmp_path: Path):
    code = (
        "import importlib, json, pathlib, sys\n"
        "MICROPYTHON = ('firmware', 'simulated_board')  # data: programs of another language\n"
        f"site = pathlib.Path({str(installed)!r})\n"
        "files = [p.relative_to(site) for p in site.rglob('*.py')]\n"
        "names = ['.'.join(p.with_suffix('').parts) for p in files if p.parts[1] not in MICROPYTHON]\n"
        "names = [n.removesuffix('.__init__') for n in names if not n.endswith('__main__')]\n"
        "files = {n: importlib.import_module(n).__file__ for n in names}\n"
        "print(json.dumps({n: f for n, f in files.items() if not f.startswith(str(site))}), len(files))"
    )
    done = run(installed, tmp_path, "-c", code)
    assert done.returncode == 0, done.stderr
    strangers, _, count = done.stdout.partition("} ")
    assert strangers == "{"
    assert int(count) > 60


def test_the_wheel_runs_a_demo(installed: Path, tmp_path: Path):
    helped = run(installed, tmp_path, "-m", "brachium", "--help")
    assert helped.returncode == 0
    assert "brachium demo" in helped.stdout
    done = run(installed, tmp_path, "-m", "brachium", "demo", "--seconds", "6", "--headless", "--json")
    assert done.returncode == 0, done.stderr
    report = json.loads(done.stdout)
    assert report["arms"]["p01/right"]["skeletons"] > 100
    assert (tmp_path / report["recording"]).is_file()
