"""docs/accuracy.md shows the figures that were measured, and no others."""

import importlib.util
import re
from pathlib import Path
from types import ModuleType

import pytest

from brachium.evaluation.catalogue import CATALOGUE
from brachium.promises import ACCURACY, AT_LEVEL

ROOT = Path(__file__).parents[2]
if not (ROOT / "docs" / "accuracy.md").exists():
    pytest.skip("docs/ is not beside tests/", allow_module_level=True)


def maker() -> ModuleType:
    path = ROOT / "docs" / "make_accuracy_tables.py"
    spec = importlib.util.spec_from_file_location("make_accuracy_tables", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


PAGE = (ROOT / "docs" / "accuracy.md").read_text(encoding="utf-8")


def test_the_page_is_as_the_figures_say():
    assert maker().rewritten(PAGE) == PAGE, "run: python docs/make_accuracy_tables.py"


def test_every_table_is_promised_once_and_every_proof_has_its_place():
    promised = [table for name, tables in ACCURACY.items() for table in tables if name not in AT_LEVEL]
    assert sorted(promised) == sorted(entry.name for entry in CATALOGUE)
    assert re.findall(r"<!-- tables ([a-z-]+) -->", PAGE) == list(ACCURACY)
