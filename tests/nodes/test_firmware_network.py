"""The files that are flashed, on MicroPython with a chip's memory, before a real gateway: loss is counted."""

import contextlib
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from brachium_nodes.emulated_board.board import Counts
from brachium_nodes.emulated_board.cell import CellSettings
from brachium_nodes.emulated_board.settings import BoardSettings
from brachium_nodes.firmware_host import (
    ACC_STEP,
    FirmwareNode,
    feed,
    prepare,
    stop_all,
)
from brachium_nodes.gateway import token_sha256
from brachium_nodes.roster import NodeEntry
from brachium_nodes.wearer import Wearer, WearerSettings
from brachium_wire.battery import is_low
from brachium_wire.messages import SampleBatch, Status
from brachium_wire.samples import read_samples

pytestmark = pytest.mark.network

SECONDS = 40.0
"""How much of the person is prepared: more than any test here takes."""
FIRMWARE_HEAP = 30 * 2048
"""Bytes: 30 of the chip's 36 K, in this host's words."""
SOON_WRAPS_US = (1 << 30) - 3_000_000


def entry(node: str, segment: str) -> NodeEntry:
    return NodeEntry(id=node, token_sha256=token_sha256(f"token of {node}"), subject="p01", segment=segment)


class Worn:
    """One node on one segment, and what its sensor really measured."""

    def __init__(self, folder: Path, segment: str, rate_hz: float, board: BoardSettings) -> None:
        self.folder, self.segment, self.board, self.rate_hz = folder / segment, segment, board, rate_hz
        self.wearer = Wearer(WearerSettings(rate_hz=rate_hz, mag_every=1, segments=(segment,), level="ideal"))
        self.start_us = 0

    def start(self, made, gateway: str, **more: object) -> FirmwareNode:
        self.start_us = time.monotonic_ns() // 1000
        prepare(
            self.folder,
            self.segment,
            f"token of {self.segment}",
            self.wearer,
            self.segment,
            seconds=SECONDS,
            start_us=self.start_us,
            gateway=gateway,
            board=self.board,
            **{"batch": 10 if self.rate_hz > 50 else 5, "longest_pause_s": 1, **more},
        )
        return FirmwareNode.start(self.folder, made)

    def numbers(self, batches: list[SampleBatch]) -> np.ndarray:
        """Return which of the person's samples each sample received is: the same shift for all of them."""
        truth = np.frombuffer(
            feed(self.wearer, self.segment, self.board, 0, int(SECONDS * self.rate_hz)),
            dtype=[("inertial", ">i2", 6), ("field", "<i2", 3)],
        )
        rows = [np.rint(read_samples(b).acc / ACC_STEP).astype(int) for b in batches]
        sent = np.concatenate(
            [np.arange(b.sequence, b.sequence + len(r)) for b, r in zip(batches, rows, strict=True)]
        )
        got = np.vstack(rows)
        middle = len(got) // 2
        shifts = np.flatnonzero((truth["inertial"][:, :3] == got[middle]).all(axis=1)) - sent[middle]
        fits = [
            s for s in shifts if (truth["inertial"][np.clip(sent + s, 0, len(truth) - 1), :3] == got).all()
        ]
        assert len(fits) == 1, f"{self.segment}: samples were mixed up, or the numbers are not theirs"
        return sent + fits[0]

    def times_are_true(self, batches: list[SampleBatch], numbers: np.ndarray) -> None:
        """Each sample's time is right within what is stated and the time between two samples."""
        got = np.concatenate([read_samples(b).time_ns for b in batches])
        stated = np.concatenate([np.full(len(read_samples(b)), b.uncertainty_ns) for b in batches])
        host_ns = time.time_ns() - time.monotonic_ns()
        true_ns = (
            host_ns + 1000 * self.start_us + 1e9 * self.wearer.clocks[self.segment].sample_time_s(numbers)
        )
        known = numbers > 0
        assert (np.abs(got - true_ns)[known] <= stated[known] + 1.5e9 / self.rate_hz).all()


@contextlib.contextmanager
def switched_on(*nodes: FirmwareNode) -> Iterator[list[Counts]]:
    """Stop the nodes at the end, whatever happens; then their reports are in the list."""
    reports: list[Counts] = []
    try:
        yield reports
    finally:
        reports += stop_all(nodes)


def test_every_chip_is_read_whole_and_on_time_whatever_its_bus_does(
    firmware, gateway, listener, tmp_path
) -> None:
    slow = BoardSettings(
        refusals=0.02, stall_us=2_500_000, stall_ms=1200, ticks_shift_us=SOON_WRAPS_US - now_us()
    )
    worn = [
        Worn(tmp_path, "upper_arm_r", 100.0, slow),
        Worn(tmp_path, "forearm_r", 50.0, BoardSettings(chip="MPU-9250", ticks_ppm=-80, field_us=45_000)),
        Worn(tmp_path, "hand_r", 50.0, BoardSettings(chip="ICM-42688-P", refusals=0.01)),
    ]
    wired: dict[str, object] = {
        "hand_r": {"id": 0, "scl": 6, "sda": 5}
    }  # the chip's own bus, as an ESP32 has
    url = gateway(*(entry(w.segment, w.segment) for w in worn)).url
    with switched_on(*(w.start(firmware, url, i2c=wired.get(w.segment, {})) for w in worn)) as reports:
        listener.until(
            lambda: (
                listener.of("imu", "upper_arm_r") and listener.of("imu", "upper_arm_r")[-1].sequence > 500
            ),
            "5 s of the upper arm",
        )
    last = listener.until_gone(3)
    for one, report in zip(worn, reports, strict=True):
        batches, status = listener.of("imu", one.segment), last["p01", one.segment]
        numbers = one.numbers(batches)
        one.times_are_true(batches, numbers)
        assert status.received == len(numbers)
        assert status.lost == numbers[-1] - numbers[0] + 1 - len(numbers)
        assert (status.out_of_order, status.late, status.node_dropped) == (0, 0, 0)
        assert set(status.drops) <= {"repeated"}  # what was being sent as the node was stopped goes out again
        assert status.rssi_dbm == -58.0
        assert 4.0 < status.battery_v < 4.15
        assert status.battery_hours > 1.0
        assert report.heap_peak - report.heap_shim <= FIRMWARE_HEAP
        assert (status.lost > 0) == (report.overflows > 0)  # a busy machine holds a FIFO up, too
    assert reports[0].overflows >= 1
    assert reports[1].refused == 0
    assert reports[0].refused + reports[2].refused > 0  # by chance: one of them alone may be spared
    assert last["p01", "upper_arm_r"].lost > 20  # 1.2 s of which a FIFO holds 0.85
    info = {i.node: i for i in listener.of("info")}
    assert {i.origin for i in info.values()} == {"emulated"}
    assert [info[w.segment].chip for w in worn] == [w.board.chip for w in worn]
    for one in worn:
        kept, told = one.wearer.chips[one.segment].calibration, info[one.segment].calibration
        assert told.gyro_bias == pytest.approx(kept.gyro_bias)
        assert (told.mag_offset is None) == (one.board.chip == "ICM-42688-P")


def now_us() -> int:
    return (time.monotonic_ns() // 1000) % (1 << 30)


def test_a_gateway_is_found_and_the_field_turned_into_the_accelerometers_axes_at_its_own_sample(
    firmware, gateway, listener, tmp_path, free_port, caplog
) -> None:
    board = BoardSettings(field_adjust=(200, 128, 60), cell=CellSettings(charge=0.045))
    one = Worn(tmp_path, "forearm_r", 50.0, board)
    gateway(entry("forearm_r", "forearm_r"), discovery_port=free_port)
    seek = {"address": "127.255.255.255", "port": free_port}
    with switched_on(one.start(firmware, "", discovery=seek)):
        listener.until(lambda: fields(listener.of("imu")) > 20, "some seconds of samples and their fields")
        listener.until(lambda: "node forearm_r: low battery" in caplog.text, "a warning of the empty cell")
    assert is_low(listener.of("status")[-1].battery_hours)
    batches = listener.of("imu")
    numbers = one.numbers(batches)
    first = numbers[0] - batches[0].sequence
    truth = one.wearer.samples("forearm_r", 0, numbers[-1] + 1).mag
    for batch in batches:
        samples = read_samples(batch)
        if samples.mag is None:
            continue
        for row, at in zip(samples.mag, samples.mag_index, strict=True):
            number = batch.sequence + at + first
            if number > 1:
                near = np.abs(truth[number - 1 : number + 2] - row).max(axis=1).min()
                assert near < 0.3, "uT: a step of the magnetometer, adjusted"


def fields(batches: list[SampleBatch]) -> int:
    return sum(0 if mag is None else len(mag) for mag in (read_samples(b).mag for b in batches))


def test_a_refused_node_comes_back_and_what_it_kept_is_marked_late(
    firmware, gateway, listener, tmp_path, free_port
) -> None:
    one = Worn(tmp_path, "forearm_r", 100.0, BoardSettings())
    first = gateway(entry("somebody", "forearm_r"), port=free_port)
    node = one.start(firmware, first.url)

    def goodbyes() -> list[Status]:
        return [s for s in listener.of("status") if not s.connected]

    with switched_on(node):
        listener.until(lambda: "does not know this node's token" in node.said(), "the refusal")
        first.end()
        second = gateway(entry("forearm_r", "forearm_r"), port=free_port)
        listener.until(lambda: len(listener.of("imu")) > 10, "samples after the refusal")
        said = len(goodbyes())  # none of the first gateway, which knew no node
        second.end()
        listener.until(lambda: len(goodbyes()) > said, "the second gateway's last status")
        before = len(listener.of("imu"))
        time.sleep(1.0)  # an outage that the queue can hold in part
        third = gateway(entry("forearm_r", "forearm_r"), port=free_port)
        assert third.url == second.url
        listener.until(lambda: len(listener.of("imu")) > before + 20, "samples after the restart")
    batches = listener.of("imu")
    numbers = one.numbers(batches)
    late = [b.late for b in batches]
    assert not any(late[:before])
    assert any(late[before:])
    assert not late[-1]
    assert (np.diff(numbers) > 0).all()
    last = [s for s in listener.of("status") if not s.connected][-1]
    assert last.late == sum(len(read_samples(b)) for b in batches if b.late)
    assert last.received == sum(len(read_samples(b)) for b in batches[before:])
    missing = numbers[-1] - numbers[0] + 1 - len(numbers)
    assert missing >= last.node_dropped
