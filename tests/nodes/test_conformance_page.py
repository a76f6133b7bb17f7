"""docs/node-conformance.md shows the rules that are judged."""

from pathlib import Path

from brachium_nodes.conformance.rules import RULES
from brachium_nodes.conformance.trial import VARIABLES

PAGE = (Path(__file__).parents[2] / "docs" / "node-conformance.md").read_text("utf-8")


def test_the_page_has_every_rule_in_its_words() -> None:
    rows = [line for line in PAGE.splitlines() if line.startswith("| `")]
    assert rows == [f"| `{rule}` | {says} |" for rule, says in RULES.items()]


def test_the_page_names_what_a_command_is_told() -> None:
    for name, variable in VARIABLES.items():
        assert f"{{{name}}}" in PAGE
        assert f"`{variable}`" in PAGE
