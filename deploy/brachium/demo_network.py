"""The demo's network: every service a process of its own, on free ports of loopback."""

import json
import threading
import time
from dataclasses import dataclass, field
from pathlib import Path

from brachium.checks import free_port
from brachium.processes import Processes
from brachium.shell import Failed
from brachium.way_in import node_table
from brachium_nodes.emulate import EmulateReport, EmulateSettings, node_entries
from brachium_wire import keys
from brachium_wire.bus import Bus, Inbox
from brachium_wire.codec import decode
from brachium_wire.messages import Status

ROOM = "demo"
NEEDED = ("router", "gateway", "fusion", "recorder")
"""The kinds of service that must be there before anybody moves."""
READY_S = 30.0
SETTLE_S = 3.0
"""How long the last word of each node is waited for."""
LOOK_S = 0.1


@dataclass(kw_only=True)
class DemoNetwork:
    """A whole network on this machine. Use it in the order of its methods, within `processes`."""

    folder: Path
    """An empty folder for logs, the site file and the recording."""
    processes: Processes
    router_port: int = field(default_factory=free_port)
    gateway_port: int = field(default_factory=free_port)

    @property
    def endpoint(self) -> str:
        """Where the router listens."""
        return f"tcp/127.0.0.1:{self.router_port}"

    @property
    def gateway(self) -> str:
        """Where the gateway listens."""
        return f"ws://127.0.0.1:{self.gateway_port}/node"

    def start(self, wearer: EmulateSettings, *, view: bool) -> None:
        """Start every service but the wearer, in no particular order: each waits for what it needs."""
        (self.folder / "logs").mkdir(parents=True)
        site = self.folder / "site.toml"
        site.write_text(site_text(wearer), encoding="utf-8")
        network = ["--room", ROOM, "--endpoint", self.endpoint]
        services = {
            "router": ["router", "--room", ROOM, "--port", str(self.router_port)],
            "fuse": ["fuse", *network],
            "gateway": ["gateway", *network, "--port", str(self.gateway_port), "--site", str(site)],
            "record": ["record", *network, "--out", str(self.folder / "recorder"), "--json"],
        }
        if view:
            services["view"] = ["view", *network, "--web-port", "0", "--grpc-port", "0"]
        for name, words in services.items():
            self.processes.start(name, words, stdout=self._log(name, "out"), stderr=self._log(name, "err"))

    def wait_ready(self, bus: Bus, stop: threading.Event) -> None:
        """Return when every needed service is there, or `stop` is set.

        Raises Failed when one died or time is up.
        """
        deadline = time.monotonic() + READY_S
        missing = set(NEEDED)
        while missing and not stop.is_set():
            alive = bus.alive(keys.services(ROOM, "*/*/alive"))
            missing = set(NEEDED) - {keys.parse(key).detail.split("/")[0] for key in alive}
            self.check()
            if time.monotonic() > deadline:
                raise Failed(f"after {READY_S:.0f} s there is still no {', '.join(sorted(missing))}")
            if missing:
                stop.wait(LOOK_S)

    def move(self, words: list[str]) -> None:
        """Start the emulated wearer."""
        network = ["--room", ROOM, "--endpoint", self.endpoint, "--gateway", self.gateway, "--json"]
        out, err = self._log("emulate", "out"), self._log("emulate", "err")
        self.processes.start("emulate", ["emulate", *network, *words], stdout=out, stderr=err)

    def check(self) -> None:
        """Raise Failed when a service that shall run does not."""
        for child in self.processes.ended():
            code = child.process.returncode if child.process is not None else None
            if child.name in ("emulate", "view") and code == 0:
                continue  # the wearer has finished; the window was closed
            raise Failed(f"{child.name} ended: {child.complaint() or 'it said nothing'}")

    def moving(self) -> bool:
        """Return whether the wearer still moves and nobody closed the view's window."""
        names = {child.name for child in self.processes.ended()}
        return not names & {"emulate", "view"}

    def view_address(self) -> str | None:
        """Return where the live view is, once it has said so."""
        path = self._log("view", "out")
        said = path.read_text("utf-8").strip() if path.exists() else ""
        return said.removeprefix("live view: ") if said else None

    def rest(self, statuses: Inbox) -> EmulateReport:
        """Let the wearer stop, wait until the gateway has closed its books, and return what was sent."""
        import msgspec

        if self.processes.end("emulate") != 0:
            raise Failed(f"the wearer failed: {last_line(self._log('emulate', 'err'))}")
        report = msgspec.json.decode(self._log("emulate", "out").read_bytes(), type=EmulateReport)
        expected = {(s, segment) for s, streams in report.streams.items() for segment in streams}
        deadline = time.monotonic() + SETTLE_S
        while expected and time.monotonic() < deadline:
            statuses.wait(LOOK_S)
            for key, payload in statuses.drain():
                if not decode(payload, Status).connected:
                    expected.discard((keys.parse(key).subject, keys.parse(key).detail))
        return report

    def finish_recording(self) -> Path:
        """End the recorder and return the closed file, moved to its place."""
        if self.processes.end("record") != 0:
            raise Failed(f"the recorder failed: {last_line(self._log('record', 'err'))}")
        made = Path(json.loads(self._log("record", "out").read_text("utf-8"))["path"])
        moved = made.rename(self.folder / "recording.mcap")
        made.parent.rmdir()
        return moved

    def _log(self, name: str, kind: str) -> Path:
        return self.folder / "logs" / f"{name}.{kind}"


def site_text(wearer: EmulateSettings) -> str:
    """Return the site file that lets this wearer's nodes in."""
    entries = node_entries(wearer)
    subjects = sorted({entry.subject for entry in entries if entry.subject})
    lines = ["[room]", f'id = "{ROOM}"', ""]
    for subject in subjects:
        lines += ["[[subject]]", f'id = "{subject}"', ""]
    return "\n".join([*lines, node_table(entries)])


def last_line(path: Path) -> str:
    """Return the last line of a log."""
    lines = path.read_text("utf-8", "replace").strip().splitlines() if path.exists() else []
    return lines[-1] if lines else "it said nothing"
