"""What a session's report costs, how large it is, and on how many pages it prints whole.

The session is emulated and solved faster than real time (`emulated_session`); the report is made as users do
it, by the command in a process of its own. Beside it stands reading the same file without a look into it.
"""

import resource
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from typing import Any

from brachium import emulated_session
from brachium.browser import chromium
from brachium.shell import Failed
from brachium_wire import recording

RUNS = 5
MINUTES = 20.0

SHEET_PX = int((210 - 2 * 12) / 25.4 * 96)
"""Between an A4 sheet's margins, at 96 dots an inch: what is wider falls off, or shrinks all the print."""

# What cannot be seen as it was drawn: a figure without a size, one that leaves its page, a cut cell, or
# anything at all that is wider than the sheet.
BROKEN = """
() => {
  const wide = document.documentElement.clientWidth;
  const bad = [];
  for (const svg of document.querySelectorAll('svg')) {
    const box = svg.getBoundingClientRect();
    const small = box.width < 50 || box.height < 20;
    if (small || box.right > wide + 1 || !svg.querySelector('path')) bad.push('figure');
    for (const text of svg.querySelectorAll('text')) {
      const at = text.getBoundingClientRect();
      if (at.width && (at.left < box.left - 2 || at.right > box.right + 2)) bad.push(text.textContent);
    }
  }
  for (const cell of document.querySelectorAll('td, th, p'))
    if (cell.scrollWidth > cell.clientWidth + 1) bad.push(cell.textContent);
  for (const part of document.querySelectorAll('h1, h2, p, ul, figure, table, td, th'))
    if (part.getBoundingClientRect().right > wide + 1 || part.scrollWidth > wide + 1)
      bad.push(`${part.tagName} is wider than the sheet: ${part.textContent.trim().slice(0, 60)}`);
  return bad;
}
"""


@dataclass(frozen=True, kw_only=True)
class ReportCost:
    """A report of a session of so many minutes."""

    minutes: float
    skeletons: int
    recording_mb: float
    report_s: float
    """The whole command, from its start to its end: the median of the runs."""
    report_cpu_s: float
    read_s: float
    """Reading the file in this process without a look into its messages: the yardstick."""
    page_mb: float
    pages: int
    """A4, as a browser prints it."""
    broken: list[str]
    """Figures and cells that are cut, empty or off the page."""
    runs_s: list[float]


def measure(minutes: float = MINUTES, runs: int = RUNS, keep: Path | None = None) -> ReportCost:
    """Measure; the page and its print are kept in the folder `keep`. Raises Failed without a browser."""
    with TemporaryDirectory() as scratch:
        folder = keep or Path(scratch)
        file, page, printed = Path(scratch) / "session.mcap", folder / "report.html", folder / "report.pdf"
        skeletons = emulated_session.write(file, minutes)
        spent = [_make(file, page) for _ in range(runs)]
        broken = look_at(page, printed)
        return ReportCost(
            minutes=minutes,
            skeletons=skeletons,
            recording_mb=file.stat().st_size / 1e6,
            report_s=median(wall for wall, _ in spent),
            report_cpu_s=median(cpu for _, cpu in spent),
            read_s=median(_read(file) for _ in range(runs)),
            page_mb=page.stat().st_size / 1e6,
            pages=pages(printed),
            broken=broken,
            runs_s=[wall for wall, _ in spent],
        )


def _make(file: Path, page: Path) -> tuple[float, float]:
    """Return wall and processor time of the command, s."""
    words = [sys.executable, "-m", "brachium", "report", str(file), "--out", str(page)]
    before, began = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    wall, after = time.perf_counter() - began, resource.getrusage(resource.RUSAGE_CHILDREN)
    if done.returncode:
        raise Failed(f"brachium report failed: {done.stderr.strip()}")
    return wall, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def _read(file: Path) -> float:
    began = time.perf_counter()
    with recording.read(file) as reading:
        for _ in reading:
            pass
    return time.perf_counter() - began


def look_at(page: Path, printed: Path) -> list[str]:
    """Print a page to PDF with a browser, and return what is broken on it."""
    with chromium() as browser:
        return print_page(browser, page, printed)


def print_page(browser: Any, page: Path, printed: Path) -> list[str]:
    """Print a page to PDF with this browser, and return what is broken on it."""
    view = browser.new_page(viewport={"width": SHEET_PX, "height": 1123})
    view.goto(page.resolve().as_uri())
    view.emulate_media(media="print")
    broken: list[str] = view.evaluate(BROKEN)
    view.pdf(path=str(printed), prefer_css_page_size=True, print_background=True)
    view.close()
    return broken


def pages(printed: Path) -> int:
    """Return how many pages a PDF has."""
    from pypdf import PdfReader

    return len(PdfReader(printed).pages)
