"""What emulated nodes keep while they are switched off: a folder, one file a node."""

import os
from dataclasses import replace
from pathlib import Path

import msgspec

from brachium_nodes.kept_calibration import calibration_of, text_of
from brachium_nodes.node_stream import NodeStream
from brachium_wire.messages import SensorCalibration


def with_flash(stream: NodeStream, folder: Path | None) -> NodeStream:
    """Return a node that brings what it kept and keeps what it is told. WireError for a spoilt file."""
    if folder is None:
        return stream
    path = folder / f"{stream.hello.node}.calibration.json"

    def store(calibration: SensorCalibration) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        fresh = path.with_suffix(f".{os.getpid()}.new")
        fresh.write_text(text_of(calibration), encoding="utf-8")
        fresh.replace(path)

    hello = stream.hello
    if path.exists():
        hello = msgspec.structs.replace(hello, calibration=calibration_of(path.read_text("utf-8")))
    return replace(stream, hello=hello, store=store)
