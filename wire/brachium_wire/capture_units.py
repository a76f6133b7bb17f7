"""Whether a capture's accelerations and angular rates are in SI units, by what they themselves say. Pure."""

import numpy as np
import numpy.typing as npt

from brachium_wire.capture_settings import CaptureError
from brachium_wire.samples import MAX_ACC, MAX_GYR, MAX_MAG

Floats = npt.NDArray[np.float64]

BOUNDS = f"above {MAX_ACC:g} m/s^2, {MAX_GYR:g} rad/s or {MAX_MAG:g} uT; is it in these units?"
LEAST_ACC, MOST_ACC = 5.0, 20.0
"""m/s^2: gravity is in every reading, so half of them cannot lie below half of it, and hardly above twice."""
BEYOND_SHARE, BEYOND_ROWS = 0.01, 10
"""So many rates that no sensor measures are another unit; fewer are faults of the radio."""
BLOCK_S = 0.25
SMALL = 0.5
"""Gravity's direction is taken to turn along a straight line between blocks: only where it turns less."""
FEWEST = 8
"""Pairs of blocks that tell anything, and by how much gravity must turn between them, rms."""
LEAST_TURN = 0.02
DEGREES = (0.012, 0.024)
"""Of the turn that the rates foretell, gravity's direction turns so much: pi / 180, and what people's own
accelerations do to it."""
ALIKE = 0.7
"""Correlation of both above which this is no chance."""


def check_acc(where: str, acc: Floats) -> None:
    """Raise CaptureError if accelerations (n, 3) cannot be m/s^2 with gravity in them."""
    middle = float(np.median(np.linalg.norm(acc, axis=1)))
    if middle >= LEAST_ACC:
        return
    looks = "is gravity taken out of them?"
    if 0.7 < middle < 1.5:
        looks = "this looks like g: multiply by 9.80665"
    raise CaptureError(
        f"{where}: half of all accelerations (ax ay az) are below {middle:.3g}; expected m/s^2 with gravity "
        f"in them, 9.8 at rest; {looks}"
    )


def check_gyr(where: str, t: Floats, acc: Floats, gyr: Floats, rates: Floats) -> None:
    """Raise CaptureError if angular rates are surely deg/s.

    Times t (n,) s, accelerations and rates (n, 3) are those of the rows that can be used; `rates` (m, 3) of
    all rows. Either many are beyond what any sensor measures in rad/s, or gravity's direction, seen from the
    sensor, turns by pi / 180 of what they foretell.
    """
    largest = np.abs(rates).max(axis=1)
    beyond = int(np.sum(largest > MAX_GYR))
    if beyond >= BEYOND_ROWS and beyond >= BEYOND_SHARE * len(largest):
        why = f"{beyond} of {len(largest)} rows reach above {MAX_GYR:g}, up to {largest.max():.4g}"
    elif _turns_in_degrees(t, acc, gyr):
        why = "gravity's direction turns by pi / 180 of what they foretell"
    else:
        return
    raise CaptureError(
        f"{where}: angular rates (gx gy gz): {why}; expected rad/s; this looks like deg/s: "
        "multiply by pi / 180 = 0.0174533"
    )


def _turns_in_degrees(t: Floats, acc: Floats, gyr: Floats) -> bool:
    period = float(np.median(np.diff(t)))
    n = max(1, round(BLOCK_S / period))
    count = len(t) // n
    if count <= FEWEST:
        return False
    force, rate = (x[: count * n].reshape(count, n, 3).mean(axis=1) for x in (acc, gyr))
    length = np.linalg.norm(force, axis=1)
    up = force / np.maximum(length, 1e-9)[:, None]
    lasts = np.diff(t[: count * n].reshape(count, n).mean(axis=1))
    turned = np.diff(up, axis=0)
    foretold = -np.cross(0.5 * (rate[1:] + rate[:-1]), 0.5 * (up[1:] + up[:-1])) * lasts[:, None]
    usable = (np.linalg.norm(turned, axis=1) < SMALL) & (lasts < 2.0 * n * period)
    turned, foretold = turned[usable], foretold[usable]
    size, wanted = float(np.sum(turned**2)), float(np.sum(foretold**2))
    if len(turned) < FEWEST or size < len(turned) * LEAST_TURN**2 or wanted == 0.0:
        return False
    both = float(np.sum(turned * foretold))
    return both > ALIKE * np.sqrt(size * wanted) and DEGREES[0] < both / wanted < DEGREES[1]


def doubts(name: str, acc: Floats | None, missing: int, beyond: int) -> list[str]:
    """Return what looks like another unit, or like loss, of one segment's accelerations (n, 3), and of rows
    left out: with a number `missing`, or `beyond` what a sensor measures."""
    said = []
    if acc is not None and float(np.median(np.linalg.norm(acc, axis=1))) > MOST_ACC:
        said.append(
            f"{name}: half of all accelerations are above {MOST_ACC:g}; "
            "expected m/s^2 with gravity in them, 9.8 at rest"
        )
    if missing:
        said.append(f"{name}: {rows(missing)} left out, because a number is missing")
    if beyond:
        said.append(f"{name}: {rows(beyond)} left out, because no sensor measures that ({BOUNDS})")
    return said


def rows(n: int, kind: str = "") -> str:
    """Return a number of rows in words."""
    return f"{n} {kind}row{'' if n == 1 else 's'}"
