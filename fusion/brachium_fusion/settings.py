"""What one chooses of the pipeline, and what changes while it runs. Pure."""

from dataclasses import asdict, dataclass, replace
from typing import Any, NamedTuple

from brachium_fusion.orientation import FilterName


@dataclass(frozen=True, slots=True, kw_only=True)
class Settings:
    """What one chooses of the pipeline."""

    filter: FilterName = "auto"
    magnetometer: bool = True
    """False leaves magnetometers aside."""
    rate_hz: float = 50.0
    """Skeletons a second, on multiples of the period in host time."""
    auto_pose: bool = True
    """Take the first stillness of all sensors as the n-pose."""
    joints: bool = True
    """With the filter `auto`: let sensors that share a joint correct one another."""

    shoulder: bool = True
    """With `joints`: follow the shoulder's displacement too."""

    @property
    def binds(self) -> bool:
        """Joints have a say; other filters stay as they were published."""
        return self.joints and self.filter == "auto"

    def chosen(self, filter_name: FilterName | None, magnetometer: bool, rate_hz: float | None) -> "Settings":
        """Return the same with what somebody chose instead; None, or True, leaves it."""
        return replace(
            self,
            filter=filter_name or self.filter,
            magnetometer=self.magnetometer and magnetometer,
            rate_hz=rate_hz or self.rate_hz,
        )

    def plain(self) -> dict[str, Any]:
        """Return the settings as plain values: Settings(**plain) are the same."""
        return asdict(self)


class Change(NamedTuple):
    """Something that is not a sample and holds from an instant on."""

    from_ns: int
    kind: str
    """`session` or `calibrate`."""
    data: dict[str, Any]
