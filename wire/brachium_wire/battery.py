"""When a sensor's battery counts as low: the one figure that whoever warns of it asks."""

LOW_BATTERY_H = 1.0 / 3.0
"""20 minutes: an exercise can be ended and the cell changed."""


def is_low(hours: float | None) -> bool:
    """Return whether a sensor that says so many hours are left is to be warned of; unknown is not low."""
    return hours is not None and hours <= LOW_BATTERY_H
