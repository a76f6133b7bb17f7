"""The one module that knows pylsl: it is loaded when it is wanted, and streams are opened with it."""

from collections.abc import Sequence
from types import ModuleType
from typing import Any, Literal

from brachium_viewer.lsl.streams import OWN, Rows, Stream

Scope = Literal["machine", "link", "site"]
"""Who finds the streams: programs on this machine, in this subnet, or as far as routers pass multicast on."""


class NoLsl(RuntimeError):
    """The library cannot be had; the text says what to do."""


def load(scope: Scope) -> ModuleType:
    """Return pylsl, told how far to be seen. Raises ModuleNotFoundError, or NoLsl when liblsl is missing.

    What is told holds for the whole process, from the first stream on.
    """
    try:
        import pylsl
        from pylsl import util
    except (RuntimeError, OSError) as error:
        why = next(iter(str(error).strip().splitlines()), "it cannot be loaded")
        raise NoLsl(
            f"pylsl is there, but not the library liblsl that it needs ({why[:200]}): install that "
            "(conda: liblsl; else the package on the releases page of sccn/liblsl), or name it in PYLSL_LIB"
        ) from None
    util.set_config_content(f"[multicast]\nResolveScope = {scope}\n[log]\nlevel = -2\n")
    module: ModuleType = pylsl
    return module


class Outlet:
    """One open stream. What does not lie after the last sample is not sent."""

    def __init__(self, pylsl: ModuleType, stream: Stream) -> None:
        self.stream = stream
        self._text = stream.content == "Markers"
        info = pylsl.StreamInfo(
            stream.name,
            stream.content,
            len(stream.channels),
            stream.rate_hz,
            "string" if self._text else "float32",
            stream.source_id,
        )
        describe(info.desc(), stream)
        self._outlet = pylsl.StreamOutlet(info)
        self._last_s = float("-inf")

    def push(self, rows: Rows, times_s: Sequence[float]) -> int:
        """Send rows (n, channels) at LSL times, s; return how many lay before the last one and were not."""
        keep: list[int] = []
        for i, time_s in enumerate(times_s):
            if time_s > self._last_s:
                self._last_s = time_s
                keep.append(i)
        if keep:
            self._outlet.push_chunk(rows[keep], [times_s[i] for i in keep])
        return len(times_s) - len(keep)

    def push_text(self, text: str, time_s: float) -> None:
        """Send a marker; those may come out of turn."""
        self._outlet.push_sample([text], time_s)


def describe(desc: Any, stream: Stream) -> None:
    """Write a stream's description into LSL's XML, as the XDF conventions have it."""
    acquisition = desc.append_child("acquisition")
    acquisition.append_child_value("manufacturer", "Brachium")
    if stream.model:
        acquisition.append_child_value("model", stream.model)
    channels = desc.append_child("channels")
    for channel in stream.channels:
        one = channels.append_child("channel")
        one.append_child_value("label", channel.label)
        one.append_child_value("marker" if channel.type.startswith("Position") else "object", channel.of)
        one.append_child_value("type", channel.type)
        one.append_child_value("unit", channel.unit)
    desc.append_child("synchronization").append_child_value("can_drop_samples", "true")
    brachium = desc.append_child("brachium")
    for name, text in stream.description.items():
        if text:
            brachium.append_child_value(name, text)


class Markers:
    """Markers of other programs, from whatever marker streams come up."""

    OPEN_WITHIN_S = 0.5

    def __init__(self, pylsl: ModuleType) -> None:
        self._pylsl = pylsl
        wanted = f"type='Markers' and not(starts-with(source_id,'{OWN}'))"
        self._resolver = pylsl.ContinuousResolver(pred=wanted)
        self._inlets: dict[str, Any] = {}
        self._names: dict[str, str] = {}

    def look(self) -> list[str]:
        """Open the streams that are new; return their names."""
        new = []
        for info in self._resolver.results():
            if info.uid() not in self._inlets:
                self._inlets[info.uid()] = self._pylsl.StreamInlet(
                    info, max_buflen=60, recover=False, processing_flags=self._pylsl.proc_clocksync
                )
                self._names[info.uid()] = info.name()
                new.append(info.name())
        return new

    def pull(self) -> list[tuple[str, str, float]]:
        """Return what came: the stream's name, the marker's text, its time by this machine's LSL clock, s."""
        found = []
        for uid, inlet in list(self._inlets.items()):
            try:
                samples, times = inlet.pull_chunk(timeout=0.0)
            except self._pylsl.util.LostError:
                del self._inlets[uid]
                continue
            for sample, time_s in zip(samples, times, strict=True):
                found.append((self._names[uid], " ".join(map(str, sample)), time_s))
        return found
