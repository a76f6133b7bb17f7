"""The CAN interface: opened, read, written, and opened again when it is gone. It alone has sockets."""

import logging
import time
from collections import Counter
from dataclasses import dataclass
from typing import Any

log = logging.getLogger(__name__)

FIRST_PAUSE_S, LONGEST_PAUSE_S = 0.5, 10.0
"""Between two attempts to open an interface that is gone."""
BUS_OFF = 0x40
"""linux/can/error.h: an error frame of this class says that the controller has left the bus."""
EXTENDED = 1 << 31
"""Stands in an id for 29 bits, as in a DBC."""


class NoInterface(RuntimeError):
    """The interface cannot be used: the text says which, why, and what to do."""


@dataclass(frozen=True, kw_only=True)
class PortSettings:
    """One CAN interface, in python-can's words."""

    interface: str = "socketcan"
    channel: str = "can0"
    bitrate: int | None = None
    """bit/s, for interfaces that are set up by the program; socketcan's is set with `ip link`."""
    data_bitrate: int | None = None
    fd: bool = False
    port: int | None = None
    """UDP port of udp_multicast."""

    def words(self) -> dict[str, Any]:
        """Return what python-can's Bus takes."""
        found: dict[str, Any] = {"interface": self.interface, "channel": self.channel}
        if self.bitrate is not None:
            found["bitrate"] = self.bitrate
        if self.data_bitrate is not None:
            found["data_bitrate"] = self.data_bitrate
        if self.fd and self.interface != "udp_multicast":  # that one always takes both kinds
            found["fd"] = True
        if self.interface == "udp_multicast":
            found["hop_limit"] = 0  # this host only: what is measured of a person does not go into the LAN
        if self.port is not None:
            found["port"] = self.port
        return found


class Port:
    """An interface that comes back. `receive` and `send` do not raise for a bus that is gone: it counts."""

    def __init__(self, settings: PortSettings) -> None:
        """Open it. Raises NoInterface when that fails, ModuleNotFoundError without the extra `can`."""
        self._settings = settings
        self._bus: Any = None
        self._counts: Counter[str] = Counter()
        self._taken = 0  # counted so often that a dict would show
        self._pause_s, self._due_s = FIRST_PAUSE_S, 0.0
        self._said = ""
        reason = self._open()
        if reason:
            raise NoInterface(reason)

    @property
    def counts(self) -> Counter[str]:
        """What it did, by name."""
        return self._counts + Counter(frames_in=self._taken)

    @property
    def there(self) -> bool:
        """Whether the interface is open."""
        return self._bus is not None

    @property
    def echoes(self) -> bool:
        """Whether our own frames come back: python-can keeps them from us, but cannot with multicast."""
        return self._settings.interface == "udp_multicast"

    def receive(self, timeout_s: float) -> tuple[int, bytes | bytearray] | None:
        """Return the next data frame's id (bit 31 set for 29 bits) and bytes, or None after `timeout_s`."""
        if self._bus is None and not self._reopened():
            time.sleep(min(timeout_s, max(self._due_s - time.monotonic(), 0.0)))
            return None
        try:
            frame = self._bus.recv(timeout_s) if self._bus is not None else None
        except Exception as error:  # drivers raise what they like; the interface is gone in any case
            self._lost(error)
            return None
        if frame is None:
            return None
        if frame.is_error_frame or frame.is_remote_frame:
            self._no_data(frame)
            return None
        self._taken += 1
        number = frame.arbitration_id
        return (number | EXTENDED if frame.is_extended_id else number), frame.data

    def send(self, number: int, data: bytes, *, fd: bool = False) -> bool:
        """Send a frame; return whether the interface took it."""
        if self._bus is None and not self._reopened():
            self._counts["not_sent"] += 1
            return False
        import can

        frame = can.Message(
            arbitration_id=number & ~EXTENDED,
            is_extended_id=bool(number & EXTENDED),
            data=data,
            is_fd=fd,
            bitrate_switch=fd,
            check=False,
        )
        try:
            assert self._bus is not None
            self._bus.send(frame, timeout=0)
        except can.CanOperationError as error:
            self._counts["not_sent"] += 1
            if "buffer" in str(error).lower():  # nobody acknowledges, or the bus is full: it stays open
                self._say(
                    f"{self.name}: frames are not taken: is another node there, and the bit rate right?"
                )
            else:
                self._lost(error)
            return False
        except Exception as error:
            self._counts["not_sent"] += 1
            self._lost(error)
            return False
        self._counts["frames_out"] += 1
        return True

    @property
    def name(self) -> str:
        """What people call it."""
        return f"{self._settings.interface} {self._settings.channel}"

    def close(self) -> None:
        """Give the interface back."""
        if self._bus is not None:
            bus, self._bus = self._bus, None
            try:
                bus.shutdown()
            except Exception as error:
                log.debug("closing %s: %s", self.name, error)

    def _open(self) -> str:
        """Open it; return "" or what is wrong."""
        import can

        try:
            self._bus = can.Bus(**self._settings.words())
        except Exception as error:  # drivers raise what they like
            return f"{self.name} cannot be opened: {_line(error)}; {self._to_do()}"
        return ""

    def _to_do(self) -> str:
        if self._settings.interface == "socketcan":
            channel = self._settings.channel
            return f"is it there and up? ip link set {channel} up type can bitrate 1000000 restart-ms 100"
        return "see docs/can.md for what --interface and --channel take"

    def _reopened(self) -> bool:
        now_s = time.monotonic()
        if now_s < self._due_s:
            return False
        self._due_s = now_s + self._pause_s
        self._pause_s = min(2.0 * self._pause_s, LONGEST_PAUSE_S)
        reason = self._open()
        if reason:
            self._say(reason)
            return False
        log.warning("%s is there again", self.name)
        self._said, self._pause_s = "", FIRST_PAUSE_S
        self._counts["interface_back"] += 1
        return True

    def _lost(self, error: Exception) -> None:
        self._counts["interface_gone"] += 1
        self._say(f"{self.name} is gone: {_line(error)}; {self._to_do()}")
        self.close()
        self._due_s = time.monotonic() + self._pause_s

    def _no_data(self, frame: Any) -> None:
        if frame.is_remote_frame:
            self._counts["remote_frames"] += 1
        elif frame.arbitration_id & BUS_OFF:
            self._counts["bus_off"] += 1
            self._say(
                f"{self.name}: the controller left the bus (bus-off): check wiring, termination, bit rate"
            )
        else:
            self._counts["error_frames"] += 1

    def _say(self, text: str) -> None:
        if text != self._said:
            log.warning("%s", text)
        self._said = text


def _line(error: Exception) -> str:
    return " ".join(str(error).split())[:200] or type(error).__name__
