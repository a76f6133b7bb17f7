"""The files of the pages, read once: what a browser may fetch is this table and nothing else."""

import gzip
import hashlib
from dataclasses import dataclass
from pathlib import Path

FOLDER = Path(__file__).parent
KINDS = {
    ".html": "text/html; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".json": "application/json; charset=utf-8",
    ".svg": "image/svg+xml",
    ".png": "image/png",
    ".woff2": "font/woff2",
    ".mp3": "audio/mpeg",
    ".ogg": "audio/ogg",
    ".wav": "audio/wav",
}
_COMPRESSED = (".html", ".css", ".js", ".json", ".svg")


@dataclass(frozen=True, kw_only=True)
class File:
    """One file as it is served."""

    body: bytes
    squeezed: bytes | None
    """The same, gzip; None where that saves nothing."""
    kind: str
    tag: str
    """Changes with what is in it."""


def pages(folder: Path = FOLDER) -> dict[str, File]:
    """Return every file of the pages by its path: `/app/main.js`, `/words/en.json`; a page by its name alone.

    `/` is index.html, `/patient` patient.html.
    """
    found = {}
    for root, place in ((folder / "pages", ""), (folder / "words", "/words")):
        for path in sorted(root.rglob("*")):
            if path.is_file() and path.suffix in KINDS:
                name = f"{place}/{path.relative_to(root).as_posix()}"
                found[_address(name)] = _file(path)
    return found


def _address(name: str) -> str:
    if name == "/index.html":
        return "/"
    return name.removesuffix(".html")


def _file(path: Path) -> File:
    body = path.read_bytes()
    squeezed = gzip.compress(body, 6, mtime=0) if path.suffix in _COMPRESSED else None
    return File(
        body=body,
        squeezed=squeezed,
        kind=KINDS[path.suffix],
        tag=f'"{hashlib.sha256(body).hexdigest()[:20]}"',
    )
