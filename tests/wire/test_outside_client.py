"""A client that shares no code with us reads what we put: docs/wire.md is enough."""

import ast
import math
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from brachium_wire import keys
from brachium_wire.bus import Bus, client_config
from brachium_wire.codec import encode
from brachium_wire.messages import Info, SegmentPose, SensorCalibration, Skeleton
from brachium_wire.samples import write_samples

pytestmark = pytest.mark.network
CLIENT = Path(__file__).parent.parent / "outside" / "client.py"
Start = Callable[..., "subprocess.Popen[str]"]


@pytest.fixture
def start(router: Any) -> Iterator[Start]:
    started: list[subprocess.Popen[str]] = []

    def begin(count: int) -> "subprocess.Popen[str]":
        command = [sys.executable, str(CLIENT), router.endpoint, "gym", str(count)]
        started.append(subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True))
        return started[-1]

    yield begin
    for process in started:
        process.kill()
        process.communicate()


def until_ready(process: "subprocess.Popen[str]") -> list[str]:
    assert process.stdout is not None
    lines: list[str] = []
    while not lines or lines[-1] != "ready":
        line = process.stdout.readline()
        assert line, process.communicate()
        lines.append(line.rstrip())
    return lines[:-1]


def skeleton(time_ns: int, elbow_rad: float | None) -> Skeleton:
    return Skeleton(
        time_ns=time_ns,
        side="right",
        origin="emulated",
        forward="facing",
        trunk_from_world=(1.0, 0.0, 0.0, 0.0),
        segments={"forearm_r": SegmentPose(quality="good", sequence=1)},
        positions={},
        angles={} if elbow_rad is None else {"elbow_flexion": elbow_rad},
    )


def test_the_client_imports_nothing_of_ours() -> None:
    imported: set[str] = set()
    for node in ast.walk(ast.parse(CLIENT.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            imported |= {alias.name.split(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            imported.add(str(node.module).split(".")[0])
    assert imported - set(sys.stdlib_module_names) == {"zenoh", "msgpack"}


def test_it_finds_retained_infos_and_prints_skeletons_and_samples(
    connect: Callable[[], Bus], start: Start, router: Any, until: Callable[[Callable[[], object], str], None]
) -> None:
    import zenoh

    bus = connect()
    info = Info(
        node="esp-1",
        rate_hz=100.0,
        origin="emulated",
        host="g",
        mounting=(0.5, 0.5, -0.5, 0.5),
        calibration=SensorCalibration(gyro_bias=(0.25, 0.0, -0.5)),
    )
    bus.retain(keys.info("gym", "p01", "forearm_r"), encode(info))
    reader = connect()
    until(lambda: reader.fetch(keys.info("gym", "p01", "forearm_r")), "the retained info")
    process = start(3)
    assert until_ready(process) == [
        "info p01 forearm_r esp-1 100 Hz emulated mounting 0.5 0.5 -0.5 0.5 bias 0.25 0 -0.5"
    ]
    batch = write_samples(
        sequence=40,
        time_ns=[1_000_000_000, 1_010_000_000],
        device_us=[0, 10_000],
        received_ns=1_020_000_000,
        uncertainty_ns=1,
        acc=[[1.0, 2.0, 3.0], [4.0, 5.0, 6.5]],
        gyr=[[0.0, 0.0, 0.0], [0.0, 0.0, 0.0]],
    )
    bus.put(keys.imu("gym", "p01", "forearm_r"), encode(batch))
    place = keys.skeleton("gym", "p01", "right")
    bus.put(place, encode(skeleton(1_000_000_000, math.radians(88.0))))
    bus.put(place, encode(skeleton(1_020_000_000, None)))
    bus.put(place, encode(info))
    with zenoh.open(client_config(router.endpoint)) as other:
        other.put("brachium/gym/*/skeleton/right", b"x")
        assert process.stdout is not None
        lines = [process.stdout.readline().rstrip() for _ in range(5)]
    assert sorted(lines) == sorted(
        [
            "imu p01 forearm_r 40 1010000000 [4.0, 5.0, 6.5]",
            "skeleton p01 1000000000 right elbow 88.000 as its segments",
            "skeleton p01 1020000000 right elbow unknown as its segments",
            "refused a message",
            "refused a key",
        ]
    )
    bus.put(place, encode(skeleton(1_040_000_000, 0.0)))
    out, err = process.communicate(timeout=60)
    assert (process.returncode, out, err) == (
        0,
        "skeleton p01 1040000000 right elbow 0.000 as its segments\n",
        "",
    )
