"""Does the low-battery warning come in time? Emulated cells empty before the firmware's own reckoning."""

import json
import random
import struct
import subprocess
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import get_args

from brachium_nodes.emulated_board.cell import Cell, CellModel, CellSettings
from brachium_nodes.firmware_build import BOARD, Build, micropython
from brachium_wire.battery import LOW_BATTERY_H

EMPTY_V = 3.3
STEPS = 1024
"""Of the converter, an ESP8266's."""
FLAT_V = 3.2
"""Here the node has long ended."""


@dataclass(frozen=True, kw_only=True)
class Discharge:
    """One cell's last hours."""

    cell: CellSettings
    stated_ma: float
    """What the configuration says of the load."""
    hours: float
    """Until the node ended."""
    warned_min: float | None
    """So long before that the warning came; None: it never did."""


def cells() -> list[CellSettings]:
    """Return cells of both models at several loads, temperatures and ages, full and half empty."""
    loads, warmths, ages, charges = (60.0, 80.0, 110.0), (5.0, 15.0, 25.0, 35.0), (0.0, 0.5, 1.0), (1.0, 0.5)
    return [
        CellSettings(model=model, load_ma=load, temperature_c=warmth, age=age, charge=charge)
        for model, load, warmth, age, charge in product(get_args(CellModel), loads, warmths, ages, charges)
    ]


def readings(cell: CellSettings, seed: int) -> bytes:
    """Return what machine.ADC reads once a second until the cell is flat, little-endian u16."""
    state, noise = Cell(cell), random.Random(seed)
    values = []
    while state.volts() > FLAT_V:
        state.drain(1.0)
        share = noise.gauss(state.volts(), cell.noise_v) / cell.full_scale_v
        values.append(max(0, min(STEPS - 1, round(share * STEPS))) * 65535 // (STEPS - 1))
    return struct.pack(f"<{len(values)}H", *values)


def discharge(
    folder: Path, made: Build, chosen: Sequence[CellSettings], *, seed: int = 0, stated_ma: float = 80.0
) -> list[Discharge]:
    """Empty these cells before the firmware's battery, in MicroPython. Raises NoMicroPython."""
    found = []
    for number, cell in enumerate(chosen):
        path = folder / f"{number}.bin"
        path.write_bytes(readings(cell, seed + number))
        case = {
            "readings": path.name,
            "seconds": path.stat().st_size // 2,
            "low_h": LOW_BATTERY_H,
            "battery": {
                "full_scale_v": cell.full_scale_v,
                "capacity_mah": cell.capacity_mah,
                "current_ma": stated_ma,
                "empty_v": EMPTY_V,
            },
        }
        (folder / "discharge.json").write_text(json.dumps(case), encoding="utf-8")
        words = [*micropython(), str(BOARD / "discharge.py"), str(made.firmware)]
        done = subprocess.run(words, cwd=folder, capture_output=True, text=True, check=False)
        if done.returncode != 0:
            raise RuntimeError(f"the firmware's battery failed: {done.stderr or done.stdout}")
        warned, ended = json.loads(done.stdout)
        found.append(
            Discharge(
                cell=cell,
                stated_ma=stated_ma,
                hours=(ended or 0) / 3600,
                warned_min=None if warned is None or ended is None else (ended - warned) / 60,
            )
        )
    return found
