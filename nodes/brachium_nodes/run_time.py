"""How long a node runs on its cell, reckoned from its parts' data sheets; no board was measured."""

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class NodeParts:
    """What a kind of node draws, mA, and where that is from."""

    name: str
    listening_ma: float
    """The radio receives whenever it does not send: no rest between messages is counted on."""
    sending_ma: float
    computing_ma: float
    """On top, while the program runs. Assumed: data sheets give it only with the radio off."""
    sensor_ma: float
    board_ma: float
    """Regulator, USB chip and LED. Assumed."""
    source: str


ESP8266 = NodeParts(
    name="ESP8266, MPU-9150",
    listening_ma=56.0,
    sending_ma=120.0,
    computing_ma=12.0,
    sensor_ma=4.3,
    board_ma=6.0,
    source="data sheets of ESP8266EX (802.11n received, and sent with MCS7 at 13 dBm) and MPU-9150 (9 axes)",
)
ESP32_C3 = NodeParts(
    name="ESP32-C3, ICM-42688-P",
    listening_ma=84.0,
    sending_ma=276.0,
    computing_ma=12.0,
    sensor_ma=0.9,
    board_ma=6.0,
    source="data sheets of ESP32-C3 (802.11n HT20 received, and sent with MCS7) and ICM-42688-P (6 axes)",
)
CLOCK_ANSWERS_HZ, STATUS_HZ = 4.0, 1.0
AIR_S = 0.5e-3
"""What one packet holds the air for beside its bytes: preamble, back-off, acknowledgement, repeats."""
AIR_S_PER_BYTE = 8 / 6.5e6
"""At 6.5 Mbit/s, the slowest of 802.11n."""
PACKET_BYTES, SAMPLE_BYTES = 130, 18
"""Headers of Wi-Fi, IP, TCP, WebSocket and the message itself; and what a sample adds."""
BUSY = {ESP8266.name: 0.0045, ESP32_C3.name: 0.0010}
"""Share of the processor for each sample a second, at 160 MHz. Estimated: the program's time on a host, by
both chips' speed in one loop; and the ESP8266's bus, which it moves bit by bit."""
RESERVE = 0.10
"""More than all of this together, for parts that are not as their data sheets say."""
USABLE = 0.95
"""Of a cell's charge, down to the voltage at which the node ends."""


@dataclass(frozen=True, kw_only=True)
class RunTime:
    """What a node draws at one rate, mA at the cell, and how long that lasts."""

    parts: str
    rate_hz: float
    batch: int
    listening_ma: float
    sending_ma: float
    computing_ma: float
    sensor_ma: float
    board_ma: float
    reserve_ma: float
    total_ma: float
    capacity_mah: float
    hours: float
    source: str


def run_time(parts: NodeParts, rate_hz: float, batch: int, capacity_mah: float = 700.0) -> RunTime:
    """Return what this node draws at this rate; a linear regulator takes as much current as it gives."""
    batches_hz = rate_hz / batch
    others_hz = CLOCK_ANSWERS_HZ + STATUS_HZ
    acknowledged_hz = batches_hz + others_hz + CLOCK_ANSWERS_HZ  # TCP acknowledges what is received, too
    sent_bytes = PACKET_BYTES * (batches_hz + others_hz + acknowledged_hz) + SAMPLE_BYTES * rate_hz
    air = AIR_S * (batches_hz + others_hz + acknowledged_hz) + AIR_S_PER_BYTE * sent_bytes
    sending = air * (parts.sending_ma - parts.listening_ma)
    computing = min(1.0, BUSY[parts.name] * rate_hz) * parts.computing_ma
    plain = parts.listening_ma + sending + computing + parts.sensor_ma + parts.board_ma
    total = plain * (1.0 + RESERVE)
    return RunTime(
        parts=parts.name,
        rate_hz=rate_hz,
        batch=batch,
        listening_ma=parts.listening_ma,
        sending_ma=round(sending, 2),
        computing_ma=round(computing, 2),
        sensor_ma=parts.sensor_ma,
        board_ma=parts.board_ma,
        reserve_ma=round(total - plain, 2),
        total_ma=round(total, 1),
        capacity_mah=capacity_mah,
        hours=round(USABLE * capacity_mah / total, 1),
        source=parts.source,
    )


def run_times() -> list[RunTime]:
    """Return the run times of both kinds of node at 50 and 100 samples a second."""
    return [
        run_time(parts, rate, batch) for parts in (ESP8266, ESP32_C3) for rate, batch in ((50, 5), (100, 10))
    ]
