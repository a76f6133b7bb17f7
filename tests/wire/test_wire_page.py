"""docs/wire.md and the golden bytes say what the code does."""

import importlib.util
import json
import re
from pathlib import Path
from types import ModuleType

import msgpack
import pytest

from brachium_wire import codec
from brachium_wire.messages import Message
from brachium_wire.topics import TOPICS

ROOT = Path(__file__).parents[2]
if not (ROOT / "docs" / "wire.md").exists():
    pytest.skip("docs/ is not beside tests/", allow_module_level=True)


def maker() -> ModuleType:
    spec = importlib.util.spec_from_file_location("make_wire_tables", ROOT / "docs" / "make_wire_tables.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


MAKER = maker()
GOLDEN: dict[str, str] = json.loads((ROOT / "tests" / "golden" / "wire.json").read_text(encoding="utf-8"))
EXAMPLES: dict[str, Message] = {MAKER.tag_of(type(message)): message for message in MAKER.EXAMPLES}


def test_the_page_is_as_the_code_says() -> None:
    page = (ROOT / "docs" / "wire.md").read_text(encoding="utf-8")
    assert MAKER.rewritten(page) == page, "run: python docs/make_wire_tables.py"


def test_every_kind_has_golden_bytes() -> None:
    ours = [kind for kind in Message.__subclasses__() if kind.__module__ == Message.__module__]
    kinds = {str(kind.__struct_config__.tag) for kind in ours}
    assert set(GOLDEN) == set(EXAMPLES) == kinds
    assert {str(row.message.__struct_config__.tag) for row in TOPICS.values()} <= kinds


@pytest.mark.parametrize("tag", sorted(GOLDEN))
def test_golden_bytes_still_mean_the_same(tag: str) -> None:
    payload = bytes.fromhex(GOLDEN[tag])
    assert codec.encode(EXAMPLES[tag]) == payload
    assert codec.decode(payload, type(EXAMPLES[tag])) == EXAMPLES[tag]
    assert msgpack.unpackb(payload)["m"] == tag


def test_hex_and_map_on_the_page_agree() -> None:
    page = (ROOT / "docs" / "wire.md").read_text(encoding="utf-8")
    pairs = re.findall(r"```\n([0-9a-f\n]+)\n```\n```\n(\{.*?\})\n```", page, re.DOTALL)
    assert len(pairs) == len(EXAMPLES)
    for text, said in pairs:
        payload = bytes.fromhex(text.replace("\n", ""))
        assert MAKER.readable(msgpack.unpackb(payload)) == json.loads(said.replace(",\n", ", "))
