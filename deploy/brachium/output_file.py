"""What an output file must not be: the measurements that it is made of."""

from pathlib import Path

from brachium.shell import Usage
from brachium_body.segments import SEGMENTS


def spare(source: Path, out: Path) -> None:
    """Raise Usage when writing `out` would write over the input, or over a table of an input folder."""
    if source.exists() and out.exists() and out.samefile(source):
        raise Usage(f"--out {out}: is the input itself; choose another name")
    inside = source.is_dir() and out.parent.is_dir() and out.parent.samefile(source)
    if inside and out.stem in (*SEGMENTS, "truth"):
        raise Usage(f"--out {out}: is a table of the input; choose another name")
