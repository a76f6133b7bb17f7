"""A report in another language: each of its texts said anew. Pure but for the catalogue's file."""

import html
import re

from brachium_viewer.catalogue import ENGLISH, catalogue

_PARTS = re.compile(r"(<style.*?</style>|<[^>]*>)", re.DOTALL)
"""Of a page: styles and tags, which stay, and between them its texts, drawings' too."""


def in_language(page: str, language: str) -> str:
    """Return an English page in this language; raises ValueError for one that there are no words of."""
    if language == ENGLISH:
        return page
    words = catalogue(language)

    def said(text: str) -> str:
        plain = html.unescape(text.strip())
        return text.replace(text.strip(), html.escape(words.told(plain), quote=False)) if plain else text

    parts = _PARTS.split(page)
    parts[::2] = [said(text) for text in parts[::2]]
    return "".join(parts).replace('<html lang="en">', f'<html lang="{language}">', 1)
