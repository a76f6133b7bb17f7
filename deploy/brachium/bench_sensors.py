"""How well sensors are calibrated: one over a whole network, many alone, badly handled ones refused."""

import json
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, fields
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from typing import Any

import msgspec

from brachium.bench_gateway import start_router
from brachium.calibrate_sensor import LONGEST_S
from brachium.checks import free_port
from brachium.processes import Processes
from brachium.sensor_trials import SEGMENT, Residuals, as_in_the_paper, guided, residuals, settings_of
from brachium.shell import Failed
from brachium.way_in import TOKEN_VARIABLE, node_table
from brachium_fusion.sensor_guide import ALL
from brachium_nodes.bench_hands import MISTAKES
from brachium_nodes.emulate import EmulateSettings, node_entries
from brachium_nodes.emulate_bench import EXERCISE
from brachium_nodes.kept_calibration import alike
from brachium_wire import keys
from brachium_wire.bus import Bus, Inbox
from brachium_wire.codec import decode
from brachium_wire.messages import Info, SensorCalibration

ROOM, SUBJECT, TOKEN, SEED = "bench", "p01", "bench", 1
READY_S = 20.0


@dataclass(frozen=True, kw_only=True)
class NetworkFigures:
    """One sensor calibrated from emulated hands to the node that keeps it."""

    steps: list[str]
    seconds: float
    kept: str
    kept_after_restart: str
    """Who keeps it when the node was switched off and on, with fusion and gateway started anew."""
    brought_again: bool
    """Whether the node then brought what was found."""
    left: Residuals


@dataclass(frozen=True, kw_only=True)
class SensorFigures:
    """Residual errors over many chips: median and worst, uncalibrated, as the paper does it, and guided."""

    network: NetworkFigures
    chips: int
    median: dict[str, Residuals]
    worst: dict[str, Residuals]
    refused: dict[str, dict[str, str]]
    """By what the hands did wrong: the steps that were refused, and why."""
    not_refused: int
    """Of these, the ones that were taken for good."""


def measure(chips: int, steps: list[str] | None = None) -> SensorFigures:
    """Measure; `steps` are those of the whole network, all if None."""
    left: dict[str, list[Residuals]] = {"uncalibrated": [], "paper": [], "guided": []}
    for seed in range(1, chips + 1):
        found = guided(seed).calibration()
        left["uncalibrated"].append(residuals(seed, SensorCalibration()))
        left["paper"].append(residuals(seed, as_in_the_paper(seed)))
        left["guided"].append(residuals(seed, found or SensorCalibration()))
    refused: dict[str, dict[str, str]] = {
        mistake: guided(SEED, mistake).progress().refused for mistake in MISTAKES if mistake
    }
    return SensorFigures(
        network=over_a_network(steps),
        chips=chips,
        median={how: _of(rows, median) for how, rows in left.items()},
        worst={how: _of(rows, max) for how, rows in left.items()},
        refused=refused,
        not_refused=sum(not reasons for reasons in refused.values()),
    )


def _of(rows: list[Residuals], take: Callable[[list[float]], float]) -> Residuals:
    names = [f.name for f in fields(Residuals)]
    return Residuals(**{name: float(take([getattr(row, name) for row in rows])) for name in names})


def over_a_network(steps: list[str] | None = None) -> NetworkFigures:
    """Calibrate one sensor through gateway, router and fusion; switch all but the router off and on again."""
    with TemporaryDirectory() as made, Processes(environment={TOKEN_VARIABLE: TOKEN}) as processes:
        network = _Network(Path(made), processes)
        with Bus.open(network.endpoint) as bus:
            infos = bus.subscribe(keys.info(ROOM, SUBJECT, SEGMENT))
            samples = bus.subscribe(keys.imu(ROOM, SUBJECT, SEGMENT))
            network.start()
            network.until(lambda: samples.received > 0, "samples")
            network.until(lambda: bool(bus.alive(keys.services(ROOM, "fusion/*/alive"))), "fusion")
            begun = time.monotonic()
            said = network.calibrate(steps)
            seconds = time.monotonic() - begun
            network.stop()
            infos.drain()
            network.start()
            again = network.info(infos)
    found = msgspec.convert(said["calibration"], SensorCalibration)
    return NetworkFigures(
        steps=[*(steps or ALL)],
        seconds=seconds,
        kept=said["kept"],
        kept_after_restart=again.kept,
        brought_again=alike(again.calibration, found),
        left=residuals(SEED, again.calibration),
    )


class _Network:
    """Router, gateway, fusion and emulated hands as the processes that a user would start."""

    def __init__(self, folder: Path, processes: Processes) -> None:
        self._folder, self._processes, self._port = folder, processes, free_port()
        self.endpoint = start_router(processes, folder)
        self._room = ["--room", ROOM, "--endpoint", self.endpoint]
        entries = node_entries(EmulateSettings(token=TOKEN, subject=SUBJECT, wearer=settings_of(SEED)))
        site = folder / "site.toml"
        site.write_text(
            f'[room]\nid = "{ROOM}"\n\n[[subject]]\nid = "{SUBJECT}"\n\n{node_table(entries)}', "utf-8"
        )
        port = ["--port", str(self._port), "--discovery-port", "0"]
        hands = ["--exercise", EXERCISE, "--subject", SUBJECT, "--segments", SEGMENT, "--seed", str(SEED)]
        door = ["--gateway", f"ws://127.0.0.1:{self._port}/node", "--flash", str(folder / "flash")]
        self._services = {
            "gateway": ["gateway", *self._room, *port, "--site", str(site)],
            "fuse": ["fuse", *self._room],
            "emulate": ["emulate", *self._room, *hands, *door],
        }

    def start(self) -> None:
        """Start all but the router."""
        for name, words in self._services.items():
            said = self._folder / f"{name}.err"
            self._processes.start(name, words, stdout=said, stderr=said)

    def stop(self) -> None:
        """End them, the last one first."""
        for name in reversed(self._services):
            self._processes.end(name)

    def until(self, reached: Callable[[], bool], what: str) -> None:
        """Wait; raises Failed when a process ended or it takes too long."""
        deadline = time.monotonic() + READY_S
        while not reached():
            for child in self._processes.ended():
                raise Failed(f"{child.name} ended: {child.complaint() or 'it said nothing'}")
            if time.monotonic() > deadline:
                raise Failed(f"after {READY_S:g} s there is still no sign of {what}")
            threading.Event().wait(0.05)

    def info(self, infos: Inbox) -> Info:
        """Return the next info of the node."""
        found: list[Info] = []

        def come() -> bool:
            found.extend(decode(payload, Info) for _, payload in infos.drain())
            return bool(found)

        self.until(come, "the node")
        return found[-1]

    def calibrate(self, steps: list[str] | None) -> dict[str, Any]:
        """Run the command; return what it says."""
        words = ["calibrate", *self._room, "--subject", SUBJECT, "--sensor", SEGMENT, "--json"]
        words += [] if steps is None else ["--steps", ",".join(steps)]
        said = self._folder / "calibrate.json"
        child = self._processes.start("calibrate", words, stdout=said, stderr=self._folder / "calibrate.err")
        assert child.process is not None
        code = child.process.wait(LONGEST_S)
        del self._processes.children["calibrate"]
        if code != 0:
            raise Failed(f"the calibration failed: {child.complaint()}")
        return dict(json.loads(said.read_text("utf-8")))
