"""Measure every figure that is promised, each by the command a user would type, into one JSON file a proof.

brachium prove --out docs/figures
"""

import argparse
import json
import os
import platform
import subprocess
import sys
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from fnmatch import fnmatch
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from brachium.option_types import folder
from brachium.shell import Failed, Usage, as_json

if TYPE_CHECKING:
    from brachium.proofs import Promise, Proof

LONGEST_S = 7200.0
"""One command: the longest, hundreds of emulated sessions, takes half of it on two slow cores."""


@dataclass(frozen=True, kw_only=True)
class Figure:
    """One figure as measured. `kept` is None where there is no target."""

    name: str
    value: float | None
    unit: str
    at_most: float | None
    kept: bool | None


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    parser.add_argument("--out", type=folder, default=Path("docs/figures"), metavar="DIR", help="for them")
    parser.add_argument("--only", default="*", metavar="PATTERN", help="only these proofs, as in demo-*")
    parser.add_argument("--data", type=Path, metavar="DIR", help="the real recordings (or $BRACHIUM_DATA)")
    parser.add_argument("--list", action="store_true", help="list what is promised, and end")


def run(args: argparse.Namespace) -> int:
    """Measure; 1 when a promise is not kept."""
    from brachium.promises import PROOFS

    chosen = [proof for proof in PROOFS if fnmatch(proof.name, args.only)]
    if not chosen:
        raise Usage(f"--only {args.only!r} names no proof; there are {', '.join(p.name for p in PROOFS)}")
    if args.list:
        print("\n".join(f"{proof.name}: {promise.name}" for proof in chosen for promise in proof.promises))
        return 0
    data = args.data or Path(os.environ.get("BRACHIUM_DATA", "../shared/data"))
    args.out.mkdir(parents=True, exist_ok=True)
    broken = []
    for proof in chosen:
        if proof.needs_data and not data.is_dir():
            print(f"{proof.name}: left out, {data} is not there (give --data)")
            continue
        figures = prove(proof, args.out, data)
        broken += [f"{proof.name}: {figure.name}" for figure in figures if figure.kept is False]
    if broken:
        raise Failed(f"{len(broken)} promises are not kept: {'; '.join(broken)}")
    return 0


def prove(proof: "Proof", out: Path, data: Path) -> list[Figure]:
    """Run one proof's commands, write its file, and return its figures."""
    said = ""
    with TemporaryDirectory() as folder:
        for command in proof.commands:
            words = [word.format(folder=folder, data=data) for word in command]
            said = _run(proof.name, words)
        # Paths of the machine that measured say nothing to others.
        said = said.replace(folder, "{folder}").replace(str(data), "{data}")
        said = said.replace(str(data.resolve()), "{data}")
    raw = json.loads(said)
    figures = [measured(promise, raw) for promise in proof.promises]
    for figure in figures:
        print(f"{proof.name}: {_words(figure)}", flush=True)
    record = {
        "name": proof.name,
        "date": datetime.now(UTC).isoformat(timespec="seconds"),
        "commands": [" ".join(["brachium", *command]) for command in proof.commands],
        "machine": {
            "system": platform.system(),
            "processor": platform.machine(),
            "cores": os.cpu_count(),
            "python": platform.python_version(),
        },
        "figures": [asdict(figure) for figure in figures],
        "raw": raw,
    }
    (out / f"{proof.name}.json").write_text(as_json(record) + "\n", encoding="utf-8")
    return figures


def measured(promise: "Promise", raw: object) -> Figure:
    """Return a promise's figure; one that is not there is not kept."""
    value = promise.take(raw) if isinstance(raw, dict) else None
    kept = None if promise.at_most is None else value is not None and value <= promise.at_most
    return Figure(name=promise.name, value=value, unit=promise.unit, at_most=promise.at_most, kept=kept)


def _run(name: str, words: list[str]) -> str:
    command = [sys.executable, "-m", "brachium", *words]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=LONGEST_S, check=False)
    except subprocess.TimeoutExpired:
        raise Failed(f"{name}: brachium {' '.join(words)}: not done in {LONGEST_S / 60:.0f} min") from None
    if done.returncode != 0 and not done.stdout.strip():
        lines = done.stderr.strip().splitlines()
        raise Failed(f"{name}: brachium {' '.join(words)}: {lines[-1] if lines else 'it said nothing'}")
    return done.stdout


def _words(figure: Figure) -> str:
    value = "not there" if figure.value is None else f"{figure.value:.4g} {figure.unit}"
    if figure.kept is None:
        return f"{figure.name} {value}"
    return (
        f"{figure.name} {value}, promised at most {figure.at_most:g}: {'kept' if figure.kept else 'NOT KEPT'}"
    )
