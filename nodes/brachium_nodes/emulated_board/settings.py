"""What an emulated board is told: one JSON file in its folder, `board.json`."""

import json
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Literal

from brachium_nodes.emulated_board.cell import CellSettings
from brachium_nodes.emulated_board.feed import FeedSettings

FILE = "board.json"
ChipName = Literal["MPU-9150", "MPU-9250", "ICM-42688-P"]


@dataclass(frozen=True, kw_only=True)
class BoardSettings:
    """One emulated board and what is wrong with it."""

    chip: ChipName = "MPU-9150"
    ticks_ppm: int = 40
    """How much faster the chip's ticks run than true time."""
    ticks_shift_us: int = 0
    refusals: float = 0.0
    """Probability that the bus refuses a transfer."""
    stall_us: int | None = None
    """When the bus stands still once, after the chip began to gather, and for how long."""
    stall_ms: int = 0
    field_us: int = 7300
    """How long the magnetometer takes for one measurement."""
    field_adjust: tuple[int, int, int] = (150, 128, 100)
    """The magnetometer's adjustment as the factory wrote it, one byte an axis."""
    send_buffer: int = 4096
    rssi_dbm: int = -58
    web_port: int = 0
    """Where this host serves what the chip serves on port 80; 0: nowhere."""
    cell: CellSettings = field(default_factory=CellSettings)


def write_board(folder: Path, board: BoardSettings, feed: FeedSettings) -> None:
    """Write the settings into a board's folder."""
    about = {"board": asdict(board), "feed": asdict(feed)}
    (folder / FILE).write_text(json.dumps(about), encoding="utf-8")


def read_board(folder: Path) -> tuple[BoardSettings, FeedSettings]:
    """Return what `write_board` wrote."""
    about = json.loads((folder / FILE).read_text("utf-8"))
    board = about["board"]
    board["field_adjust"] = tuple(board["field_adjust"])
    board["cell"] = CellSettings(**board["cell"])
    return BoardSettings(**board), FeedSettings(**about["feed"])
