"""Every table by its name, in the order in which they stand on a page."""

from collections.abc import Callable
from dataclasses import dataclass

from brachium.evaluation import (
    alignment_tables,
    arm_tables,
    detection,
    donning_tables,
    long_run,
    recording_tables,
    repetition_tables,
    sensor_sets,
    slip_tables,
    tsilomitrou_tables,
    wear_tables,
    zhou_limits,
    zhou_tables,
)
from brachium.evaluation.context import Context
from brachium.evaluation.tables import Table


@dataclass(frozen=True, slots=True, kw_only=True)
class Entry:
    """One kind of table, which may come once for each level or recording."""

    name: str
    shows: str
    make: Callable[[Context], list[Table]]
    needs_data: bool = False


CATALOGUE: tuple[Entry, ...] = (
    Entry(name="broad", shows="one 9-axis sensor against optical orientation", needs_data=True,
          make=recording_tables.broad),
    Entry(name="two-segments", shows="two segments on a joint, no magnetometer", needs_data=True,
          make=recording_tables.two_segments),
    Entry(name="people", shows="people without a truth: plausible arms", needs_data=True,
          make=recording_tables.people),
    Entry(name="arm", shows="two sensors: shoulder, wrist, angles", make=arm_tables.arm),
    Entry(name="loss", shows="5 % loss in bursts", make=arm_tables.loss),
    Entry(name="long-run", shows="half an hour: growth, disturbed field, no magnetometer",
          make=long_run.long_run),
    Entry(name="alignment", shows="axes and heading from the calibration routine",
          make=alignment_tables.alignment),
    Entry(name="contracture", shows="an elbow that stops at 35 deg", make=alignment_tables.contracture),
    Entry(name="refusals", shows="calibration movements that cannot be used", make=alignment_tables.refusals),
    Entry(name="wear-check", shows="200 wearers: right, swapped, turned, arms exchanged",
          make=wear_tables.wear),
    Entry(name="slip", shows="a strap that slips by 8 deg", make=slip_tables.slip),
    Entry(name="tsilomitrou", shows="Tables 4 and 5 of Tsilomitrou et al. 2021",
          make=tsilomitrou_tables.places),
    Entry(name="tsilomitrou-angles", shows="joint angles in its three experiments",
          make=tsilomitrou_tables.angles),
    Entry(name="packet-loss", shows="0 to 20 % loss, single and in bursts",
          make=tsilomitrou_tables.packet_loss),
    Entry(name="calibration-left-out", shows="the elbow test without each sensor calibration",
          make=tsilomitrou_tables.calibration_left_out),
    Entry(name="zhou", shows="Tables 1 to 5 of Zhou et al. 2008", make=zhou_tables.zhou),
    Entry(name="zhou-errata", shows="its text, erratum by erratum", make=zhou_limits.errata),
    Entry(name="zhou-lambda", shows="lambda of one wearer used on another", make=zhou_limits.lambda_transfer),
    Entry(name="zhou-places", shows="sensors worn in other places", make=zhou_limits.arrangements),
    Entry(name="detection", shows="the smallest movement that is seen", make=detection.detection),
    Entry(name="repetitions", shows="200 sessions: repetitions counted, ranges of motion",
          make=repetition_tables.repetitions),
    Entry(name="donnings", shows="the same movement, sensors put on anew: what is called a change",
          make=donning_tables.donnings),
    Entry(name="sensor-sets", shows="one, two and three sensors, right and left",
          make=sensor_sets.sensor_sets),
)  # fmt: skip


def find(names: list[str]) -> tuple[Entry, ...]:
    """Return the entries of these names, all for none. Raises ValueError for one that is not known."""
    for name in names:
        if name not in {entry.name for entry in CATALOGUE}:
            raise ValueError(f"table {name!r} is not known; there are {', '.join(e.name for e in CATALOGUE)}")
    return tuple(entry for entry in CATALOGUE if not names or entry.name in names)
