"""Two arms that move for some ten seconds, emulated and solved once: what every format is made of."""

from pathlib import Path

import pytest

from brachium import bench_exports
from brachium_wire.table import Table


@pytest.fixture(scope="session")
def capture(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A capture folder of two arms that do the same; for 1.5 s nothing is heard of the left one."""
    folder = tmp_path_factory.mktemp("export") / "capture"
    bench_exports.write_capture(folder, "drinking")
    return folder


@pytest.fixture(scope="session")
def result(capture: Path) -> Table:
    """The same, solved."""
    return bench_exports.solved(capture)
