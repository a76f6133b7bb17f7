"""A calibration that fusion found reaches its node, is stored there, and is brought by it from then on."""

import asyncio
import json
import subprocess
import threading
import time
from pathlib import Path

import pytest

from brachium_nodes import emulate_bench
from brachium_nodes.bench_hands import MISTAKES
from brachium_nodes.emulate import EmulateSettings, node_entries
from brachium_nodes.emulated_board.settings import BoardSettings
from brachium_nodes.emulated_flash import with_flash
from brachium_nodes.firmware_build import micropython
from brachium_nodes.firmware_host import FirmwareNode, prepare
from brachium_nodes.gateway import token_sha256
from brachium_nodes.kept_calibration import LONGEST_TEXT, Keeping, alike, calibration_of, text_of
from brachium_nodes.known_calibrations import KnownCalibrations
from brachium_nodes.node_client import NodeClient
from brachium_nodes.node_frames import Hello
from brachium_nodes.node_stream import NodeStream
from brachium_nodes.roster import NodeEntry
from brachium_nodes.wearer import Wearer, WearerSettings
from brachium_wire import calibration_file, keys
from brachium_wire.bus import Bus
from brachium_wire.codec import WireError, encode
from brachium_wire.messages import Calibration, Info, SensorCalibration

ROOM = "test"
FOUND = SensorCalibration(
    gyro_bias=(0.125, -0.0625, 0.001953125),
    accel_scale=(1.015625, 0.984375, 1.0),
    accel_bias=(0.25, -0.5, 0.125),
    mag_offset=(12.5, -40.25, 3.0),
    mag_matrix=((1.03125, 0.0078125, 0.0), (0.0078125, 0.96875, 0.0), (0.0, 0.0, 1.0)),
)
LATER = SensorCalibration(gyro_bias=(0.25, 0.0, 0.0))


def tell(bus: Bus, *nodes: str, found: SensorCalibration = FOUND) -> None:
    """Say, as fusion does, what was found of these nodes' sensors."""
    calibration = Calibration(time_ns=1, state="none", sensors=dict.fromkeys(nodes, found))
    bus.retain(keys.calibration(ROOM, "p01"), encode(calibration))


def entry(node: str = "n1") -> NodeEntry:
    return NodeEntry(id=node, token_sha256=token_sha256("secret"), subject="p01", segment="forearm_r")


def worst() -> SensorCalibration:
    long = (-1.2345678e-05, -123.45678, -1.2345678e-05)
    return SensorCalibration(
        gyro_bias=long, accel_scale=long, accel_bias=long, mag_offset=long, mag_matrix=(long, long, long)
    )


def test_the_text_is_short_and_says_the_same() -> None:
    assert calibration_of(text_of(FOUND)) == FOUND
    assert alike(calibration_of(text_of(worst())), worst())
    assert len(text_of(worst())) <= LONGEST_TEXT
    assert not alike(FOUND, LATER)
    assert not alike(SensorCalibration(), LATER)
    for text in ("", "[]", '{"gyro_bias": 1}', '{"gyro_bias": [1, 2]}'):
        with pytest.raises(WireError):
            calibration_of(text)


def test_who_keeps_it_follows_what_the_node_says() -> None:
    assert Keeping(SensorCalibration(), SensorCalibration()).keeper == ""
    assert Keeping(FOUND, FOUND).frame() is None
    keeping = Keeping(LATER, FOUND)
    assert keeping.keeper == "gateway"
    frame = keeping.frame()
    assert frame is not None
    assert calibration_of(frame.calibration) == FOUND
    keeping.kept()
    assert keeping.keeper == "node"


def test_what_was_found_holds_until_the_node_keeps_it_and_a_folder_has_every_part(tmp_path: Path) -> None:
    known = KnownCalibrations(tmp_path)
    news = Calibration(time_ns=1, state="none", sensors={"n1": FOUND})
    assert known.hear(news) == {"n1": FOUND}
    assert known.hear(news) == {}
    assert known.of("n1", LATER) == FOUND
    known.told(Info(node="n1", rate_hz=50.0, origin="worn", host="gw", calibration=FOUND, kept="node"))
    assert known.of("n1", LATER) == LATER
    assert KnownCalibrations(tmp_path).of("n1", SensorCalibration()) == FOUND
    file = calibration_file.read(calibration_file.path_of(tmp_path, "n1"))
    assert [fit.part for fit in file.fits] == list(calibration_file.PARTS)
    known.hear(Calibration(time_ns=2, state="none", sensors={"n1": LATER}))
    file = calibration_file.read(calibration_file.path_of(tmp_path, "n1"))
    assert file.calibration == LATER
    assert len(file.fits) == 6
    known.hear(Calibration(time_ns=2, state="none", sensors={"../n1": LATER}))
    assert [p.name for p in tmp_path.iterdir()] == ["n1.json"]


class Joined:
    """A node of an emulator on an event loop of its own."""

    def __init__(self, url: str, stores: bool, **more: object) -> None:
        self.stored: list[SensorCalibration] = []
        hello = Hello(
            **{"node": "n1", "boot": 1, "chip": "MPU-9150", "rate_hz": 100.0, "magnetometer": True} | more
        )
        store = self.stored.append if stores else self._refuse
        self._client = NodeClient(url, "secret", hello, lambda: 1_000_000, store)
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._loop.run_forever, daemon=True)
        self._thread.start()
        asyncio.run_coroutine_threadsafe(self._client.join(), self._loop).result(10)

    def _refuse(self, _calibration: SensorCalibration) -> None:
        raise OSError("the flash is full")

    def leave(self) -> None:
        asyncio.run_coroutine_threadsafe(self._client.leave(0), self._loop).result(10)
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join(15.0)
        self._loop.close()


@pytest.mark.network
def test_a_node_that_is_there_or_comes_back_is_told_once(gateway, listener, bus) -> None:
    url = gateway(entry()).url
    node = Joined(url, stores=True, calibration=LATER)
    listener.until(lambda: listener.of("info"), "the node's info")
    assert [(i.calibration, i.kept) for i in listener.of("info")] == [(LATER, "node")]
    tell(bus, "n1", "stranger")
    listener.until(lambda: listener.of("info")[-1].kept == "node" and len(listener.of("info")) == 3, "kept")
    assert [(i.calibration, i.kept) for i in listener.of("info")[1:]] == [(FOUND, "gateway"), (FOUND, "node")]
    tell(bus, "n1")
    node.leave()
    assert node.stored == [FOUND]
    tell(bus, "n1", found=LATER)  # it is away
    again = Joined(url, stores=True, calibration=FOUND)
    listener.until(lambda: again.stored, "what was found meanwhile")
    again.leave()
    assert again.stored == [LATER]


@pytest.mark.network
def test_a_gateway_that_starts_later_brings_it_and_keeps_it_for_a_node_that_cannot(
    gateway, listener, bus, caplog
) -> None:
    tell(bus, "n1")
    node = Joined(gateway(entry()).url, stores=False)
    listener.until(lambda: listener.of("info"), "the node's info")
    assert (listener.of("info")[0].calibration, listener.of("info")[0].kept) == (FOUND, "gateway")
    node.leave()  # it said nothing, and went on
    assert {i.kept for i in listener.of("info")} == {"gateway"}
    assert "the flash is full" in caplog.text


@pytest.mark.network
def test_the_firmware_stores_it_and_brings_it_when_it_is_switched_on_again(
    firmware, gateway, listener, bus, tmp_path
) -> None:
    url, folder = gateway(entry()).url, tmp_path / "flash"
    wearer = Wearer(WearerSettings(rate_hz=50.0, segments=("forearm_r",), level="ideal"))
    start_us = time.monotonic_ns() // 1000
    prepare(
        folder, "n1", "secret", wearer, "forearm_r",
        seconds=30.0, start_us=start_us, gateway=url, board=BoardSettings(),
    )  # fmt: skip
    node = FirmwareNode.start(folder, firmware)
    listener.until(lambda: listener.of("imu"), "samples")
    tell(bus, "n1")
    listener.until(lambda: alike(listener.of("info")[-1].calibration, FOUND), "the new calibration")
    listener.until(lambda: listener.of("info")[-1].kept == "node", "the node's word that it is stored")
    before = len(listener.of("imu"))
    listener.until(lambda: len(listener.of("imu")) > before + 10, "samples as before")
    report = node.stop()
    assert (report.heap_peak - report.heap_shim) / 2048 <= 30.0
    assert calibration_of((folder / "calibration.json").read_text("utf-8")) == FOUND
    assert not (folder / "calibration.new").exists()
    tell(bus)  # fusion knows nothing any more: the node alone does
    infos = len(listener.of("info"))
    node = FirmwareNode.start(folder, firmware)
    listener.until(lambda: len(listener.of("info")) > infos, "the node that was switched on again")
    node.stop()
    last = listener.of("info")[-1]
    assert (last.kept, alike(last.calibration, FOUND)) == ("node", True)


def test_a_flash_with_anything_in_it_is_no_crash(firmware, tmp_path: Path) -> None:
    program = tmp_path / "program.py"
    program.write_text(
        "import sys, json; sys.path.insert(0, sys.argv[1]); import keeping as k\n"
        "said = [k.calibration()]\n"
        "for text in ('[1]', '{', '{\"x\": 1, \"gyro_bias\": [1, 2, 3]}', None, 7):\n"
        "    said.append([k.keep(text), k.calibration()])\n"
        "print(json.dumps(said))"
    )
    words = [*micropython(), str(program), str(firmware.firmware)]
    done = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, timeout=60, check=True)
    known = {"gyro_bias": [1, 2, 3]}
    assert json.loads(done.stdout.splitlines()[-1]) == [
        {}, [True, {}], [True, {}], [True, known], [False, known], [False, known],
    ]  # fmt: skip


def test_an_emulated_nodes_flash_outlives_it(tmp_path: Path) -> None:
    hello = Hello(node="n1", boot=1, chip="MPU-9150", rate_hz=100.0)
    stream = NodeStream(
        subject="p01", segment="forearm_r", hello=hello, mounting=None, packets=iter(()), clock_us=int
    )
    assert with_flash(stream, None) is stream
    first = with_flash(stream, tmp_path / "flash")
    assert first.hello == hello
    first.store(FOUND)
    first.store(LATER)
    assert with_flash(stream, tmp_path / "flash").hello.calibration == LATER
    assert [p.name for p in (tmp_path / "flash").iterdir()] == ["n1.calibration.json"]
    (tmp_path / "flash" / "n1.calibration.json").write_text(json.dumps([1]))
    with pytest.raises(WireError, match="no calibration"):
        with_flash(stream, tmp_path / "flash")


def test_a_bench_is_one_wearers() -> None:
    assert set(emulate_bench.EXERCISES.values()) == set(MISTAKES)
    settings = EmulateSettings(direct=True, wearers=2)
    with pytest.raises(ValueError, match="one wearer"):
        emulate_bench.run(settings, "", threading.Event())
    assert len(node_entries(settings)) == 6
