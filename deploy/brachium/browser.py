"""The machine's Chromium, driven without a screen and without a graphics card: for pages and printed reports.

BRACHIUM_CHROMIUM names the program where it is not in the PATH.
"""

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from brachium.shell import Failed

if TYPE_CHECKING:
    from playwright.sync_api import Browser

PROGRAMS = ("chromium", "chromium-browser", "google-chrome")
FLAGS = [
    "--no-sandbox",  # containers
    "--disable-gpu",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-quic",
    "--disable-sync",
    "--no-first-run",
]
"""No graphics card: the page is put together by the processor, and so is what WebGL draws. And no word of the
browser's own to anybody."""


@contextmanager
def chromium() -> "Iterator[Browser]":
    """Start Chromium. Raises Failed without it or playwright."""
    names = (os.environ.get("BRACHIUM_CHROMIUM"), *PROGRAMS)
    program = next((found for name in names if name and (found := shutil.which(name))), None)
    if program is None:
        raise Failed("this needs Chromium (apt install chromium)")
    try:
        from playwright.sync_api import sync_playwright
    except ModuleNotFoundError:
        raise Failed("this needs playwright, which drives Chromium: pip install playwright") from None
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=program, headless=True, args=FLAGS)
        try:
            yield browser
        finally:
            browser.close()
