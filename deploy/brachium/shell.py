"""What every command shares: its parser, its stop event, its log, its exit code."""

import argparse
import json
import logging
import os
import signal
import sys
import threading
from collections.abc import Callable
from types import FrameType
from typing import Any, Protocol

from brachium_wire import keys

EXTRAS = {
    "pyarrow": "parquet",
    "rerun": "view",
    "jinja2": "report",
    "matplotlib": "report",
    "can": "can",
    "pylsl": "lsl",
    "cantools": "can",
    "segno": "site",
    "ezc3d": "export",
    "aiohttp": "web",
}
"""Heavy packages and the extra that brings each."""

PARENT = "BRACHIUM_PARENT"
"""Variable that names the process whose end a service shall not outlive."""

log = logging.getLogger("brachium")

Options = argparse.ArgumentParser | argparse._ArgumentGroup
"""Where options are added."""


class Command(Protocol):
    """What a module of `brachium.commands` holds. Its docstring's last paragraph is an example."""

    __doc__: str | None

    def configure(self, parser: argparse.ArgumentParser) -> None:
        """Add the command's options."""

    def run(self, args: argparse.Namespace) -> int | None:
        """Do it; return the exit code, None for 0."""


class Usage(ValueError):
    """Bad input: the text says what was expected, what came and what to do. Exit code 2."""


class Failed(RuntimeError):
    """It broke while running: the text says what and why. Exit code 1."""


def run_command(name: str, summary: str, module: Any, words: list[str]) -> int:
    """Parse `words` for one command, run it, and return its exit code with at most one line of complaint."""
    command: Command = module
    parser = argparse.ArgumentParser(
        prog=f"brachium {name}",
        description=f"{summary[0].upper()}{summary[1:]}.",
        epilog=_epilog(command.__doc__ or ""),
        formatter_class=_Help,
    )
    command.configure(parser)
    parser.add_argument("-v", "--verbose", action="store_true", help="log more, with the origin of an error")
    args = parser.parse_args(words)  # exits with 2 by itself
    _start_log(args.verbose)
    try:
        if "room" in args:
            keys.chunk(args.room, "room")
        if getattr(args, "subject", None) not in (None, "*"):
            keys.subject_chunk(args.subject)
        return command.run(args) or 0
    except KeyboardInterrupt:
        return 1
    except BrokenPipeError:  # the reader of our output went away, as `| head` does
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except Exception as error:
        code, text = _complaint(error)
        if text is None:
            raise
        log.debug("this came from", exc_info=error)
        print(f"brachium {name}: {text}", file=sys.stderr)
        return code


def add_room(parser: Options) -> None:
    """Add --room."""
    parser.add_argument("--room", default=keys.DEFAULT_ROOM, help="the room's name in keys")


def add_network(parser: Options) -> None:
    """Add the options of every command that joins a network."""
    add_room(parser)
    parser.add_argument("--endpoint", default="tcp/127.0.0.1:7447", help="where the router listens")


def add_json(parser: argparse.ArgumentParser) -> None:
    """Add --json: figures for programs instead of for people."""
    parser.add_argument("--json", action="store_true", help="print figures as JSON")


def as_json(figures: object) -> str:
    """Return a record, a dataclass or a dict as JSON; a number that is not known is null."""
    import msgspec

    return json.dumps(msgspec.to_builtins(figures, enc_hook=str), indent=2, allow_nan=False)


def print_json(figures: object) -> None:
    """Print the same."""
    print(as_json(figures), flush=True)


def stop_on_signals() -> threading.Event:
    """Return the event that SIGINT and SIGTERM set. A second signal ends the process at once."""
    stop = threading.Event()

    def asked(number: int, frame: FrameType | None) -> None:
        del frame
        signal.signal(number, signal.SIG_DFL)
        stop.set()

    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, asked)
    parent = os.environ.get(PARENT)
    if parent is not None:
        threading.Thread(target=_stop_when_orphaned, args=(int(parent), stop), daemon=True).start()
    return stop


def _stop_when_orphaned(parent: int, stop: threading.Event) -> None:
    """Set `stop` once the process that started us is gone; killed, it cannot end its services itself."""
    while os.getppid() == parent and not stop.wait(1.0):
        pass
    stop.set()


def serve(run: Callable[[threading.Event], object]) -> int:
    """Run a service until it ends or a signal stops it. Being stopped while it starts is no failure."""
    stop = stop_on_signals()
    try:
        run(stop)
    except RuntimeError:
        if not stop.is_set():
            raise
    return 0


class _Help(argparse.RawDescriptionHelpFormatter):
    """Shows each option's default, where there is one."""

    def _get_help_string(self, action: argparse.Action) -> str | None:
        shown = action.help and action.default not in (None, False, [], argparse.SUPPRESS)
        return f"{action.help} (default: %(default)s)" if shown else action.help


def _complaint(error: Exception) -> tuple[int, str | None]:
    if isinstance(error, ModuleNotFoundError):
        extra = EXTRAS.get((error.name or "").split(".")[0])
        return 1, extra and f"this needs the package {error.name!r}: pip install 'brachium[{extra}]'"
    if isinstance(error, FileNotFoundError | IsADirectoryError | NotADirectoryError | FileExistsError):
        return 2, f"{error.strerror or error}: {error.filename}" if error.filename else str(error)
    if isinstance(error, ValueError):  # every part's own words on bad input
        return 2, str(error)
    if isinstance(error, RuntimeError | OSError):
        return 1, str(error)
    return 1, None


def _epilog(docstring: str) -> str:
    return "example:\n  " + docstring.strip().split("\n\n")[-1].strip()


def _start_log(verbose: bool) -> None:
    logging.basicConfig(
        level=logging.DEBUG if verbose else logging.INFO,
        stream=sys.stderr,
        format="%(asctime)s %(name)s %(levelname)s %(message)s",
    )
    for noisy in ("websockets", "asyncio", "matplotlib", "PIL"):
        logging.getLogger(noisy).setLevel(logging.WARNING)


def count(number: int, what: str) -> str:
    """Return how many there are of something, as people say it."""
    return f"{number} {what}{'' if number == 1 else 's'}"
