"""A report in another language: each of its texts said anew. Pure but for the catalogue's file."""

import html
import re
from collections.abc import Callable

from brachium_viewer.catalogue import ENGLISH, catalogue

_PARTS = re.compile(r"(<style.*?</style>|<[^>]*>)", re.DOTALL)
"""Of a page: styles and tags, which stay, and between them its texts, drawings' too."""


def speaker(language: str) -> Callable[[str], str]:
    """Return what says an English text in a language; raises ValueError for one without words."""
    return str if language == ENGLISH else catalogue(language).told


def in_language(page: str, language: str) -> str:
    """Return an English page in this language; raises ValueError for one that there are no words of."""
    if language == ENGLISH:
        return page
    told = speaker(language)

    def said(text: str) -> str:
        plain = html.unescape(text.strip())
        return text.replace(text.strip(), html.escape(told(plain), quote=False)) if plain else text

    parts = _PARTS.split(page)
    parts[::2] = [said(text) for text in parts[::2]]
    return "".join(parts).replace('<html lang="en">', f'<html lang="{language}">', 1)
