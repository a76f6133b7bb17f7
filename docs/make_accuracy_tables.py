"""Write the tables of docs/accuracy.md from docs/figures/accuracy-*.json.

Run `brachium prove --only "accuracy-*"`, then `python docs/make_accuracy_tables.py`; a test fails until then.
"""

import json
import re
from pathlib import Path
from typing import Any

from brachium.evaluation.tables import Table
from brachium.promises import ACCURACY

HERE = Path(__file__).parent
PAGE = HERE / "accuracy.md"
FIGURES = HERE / "figures"
MARK = re.compile(r"(<!-- tables (?P<name>[a-z-]+) -->\n).*?(<!-- end -->)", re.DOTALL)
SUMMARY = re.compile(r"(<!-- limits -->\n).*?(<!-- end -->)", re.DOTALL)


def records() -> dict[str, dict[str, Any]]:
    """Return what each proof left, by its name without `accuracy-`."""
    found = {}
    for name in ACCURACY:
        path = FIGURES / f"accuracy-{name}.json"
        if path.is_file():
            found[name] = json.loads(path.read_text(encoding="utf-8"))
    return found


def tables(record: dict[str, Any]) -> list[Table]:
    """Return one proof's tables."""
    return [Table.from_plain(table) for table in record["raw"]["tables"].values()]


def section(record: dict[str, Any]) -> str:
    """Return the tables of one proof, with their date and command."""
    (command,) = record["commands"]
    made = f"Made on {record['date'][:10]} by `{command}`."
    return "\n\n".join([made, *(table.markdown() for table in tables(record))]) + "\n"


def summary(found: dict[str, dict[str, Any]]) -> str:
    """Return every limit of every table, and whether it is met."""
    lines = ["| table | figure | limit | measured | |", "|---|---|---|---|---|"]
    for record in found.values():
        for table in tables(record):
            for limit in table.limits:
                bound = f"{'at least' if limit.at_least else 'at most'} {limit.at_most:g} {limit.unit}"
                said = "met" if limit.met else "**not met**"
                value = "-" if limit.value is None else f"{limit.value:.3g}"
                lines.append(f"| {table.name} | {limit.what} | {bound} | {value} | {said} |")
    return "\n".join(lines) + "\n"


def rewritten(page: str) -> str:
    """Return the page with its tables made anew; a proof that is not there leaves its section as it is."""
    found = records()

    def fill(match: re.Match[str]) -> str:
        record = found.get(match["name"])
        return match[0] if record is None else f"{match[1]}{section(record)}{match[3]}"

    page = MARK.sub(fill, page)
    return SUMMARY.sub(lambda m: f"{m[1]}{summary(found)}{m[2]}", page)


if __name__ == "__main__":
    PAGE.write_text(rewritten(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
    print(PAGE)
