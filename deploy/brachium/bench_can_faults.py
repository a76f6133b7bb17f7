"""What a machine on CAN is told when something breaks: real processes, one fault a round."""

import logging
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from brachium.bench_run import helpers
from brachium.can_fault_figures import FaultFigures, Frames, ShowsNothing, figures
from brachium.can_traffic import GROUP
from brachium.can_wearer import SEGMENTS, wearer
from brachium.checks import free_port
from brachium.processes import Processes
from brachium.shell import Failed
from brachium.way_in import node_table
from brachium_nodes.emulated_nodes import node_id
from brachium_nodes.gateway import token_sha256
from brachium_nodes.roster import NodeEntry
from brachium_wire import keys
from brachium_wire.bus import Bus, Inbox
from brachium_wire.codec import decode
from brachium_wire.hosttime import follow_host_time
from brachium_wire.messages import Skeleton

log = logging.getLogger(__name__)

ROOM, TOKEN = "can-bench", "can-bench-token"
LEAD_S = 8.0
"""Until true time 0: three processes start and join."""
FAULT_S = 12.0
"""True time of a fault: the wearer has stood, the pose was taken, the arm moves."""
AFTER_S = 3.0
MOST_AGAIN = 6
JUMPS_DEG = (10.0, 30.0, -90.0)


@dataclass(frozen=True, kw_only=True)
class FaultReport:
    """All rounds."""

    wrong_after: int
    """Joints said to be valid and more than 5 deg off, in frames sent more than 50 ms after a fault."""
    frames_after: int
    worst_after_deg: float | None
    valid_before: float
    """Share of measured joints that were valid before the faults, in the worst round."""
    worst_before_deg: float | None
    rounds_again: int
    """Made once more, because nothing was valid before the fault: on a machine that is too busy."""
    rounds: list[FaultFigures]


def measure() -> FaultReport:
    """Break each thing once, in networks of real processes on this machine."""
    kinds: list[tuple[str, float]] = [("jump", deg) for deg in JUMPS_DEG]
    kinds += [("field turned", 60.0), ("node killed", 0.0), ("fusion killed", 0.0), ("router killed", 0.0)]
    found, again = list[FaultFigures](), 0
    with tempfile.TemporaryDirectory() as folder:
        while kinds:
            try:
                found.append(one_round(Path(folder) / f"{len(found)}-{again}", *kinds[0]))
                kinds.pop(0)
            except ShowsNothing as error:
                again += 1
                if again > MOST_AGAIN:
                    raise
                log.warning("again: %s", error)
    return FaultReport(
        wrong_after=sum(one.wrong_after for one in found),
        frames_after=sum(one.frames_after for one in found),
        worst_after_deg=max((one.worst_after_deg or 0.0 for one in found), default=None),
        valid_before=min(one.valid_before for one in found),
        worst_before_deg=max((one.worst_before_deg or 0.0 for one in found), default=None),
        rounds_again=again,
        rounds=found,
    )


def one_round(folder: Path, kind: str, jump_deg: float) -> FaultFigures:
    """Start a network, break one thing, and say what the frames said."""
    folder.mkdir()
    router, gateway, channel = free_port(), free_port(), free_port()
    endpoint = f"tcp/127.0.0.1:{router}"
    with Processes() as services, helpers() as nodes:
        _start(folder, services, router, gateway, channel)
        with Bus.open(endpoint, timeout_s=20.0) as bus, _listening(channel) as heard:
            _ready(bus)
            clock = follow_host_time(bus, ROOM, "gateway")
            truth = bus.subscribe(keys.truth(ROOM, "p01", "right"))
            start_ns = time.monotonic_ns() + round(LEAD_S * 1e9)
            for segment in SEGMENTS:
                words = ["--endpoint", endpoint, "--room", ROOM, "--token", TOKEN, "--subject", "p01"]
                words += ["--gateway", f"ws://127.0.0.1:{gateway}/node", "--segment", segment]
                words += ["--start-ns", str(start_ns)]
                words += ["--turned"] if kind == "jump" else []
                if jump_deg and segment == "forearm_r":
                    words += ["--jump-s", str(FAULT_S), "--jump-deg", str(jump_deg)]
                if segment == "upper_arm_r":
                    words += ["--truth"]
                name = f"node-{segment}"
                nodes.start(name, ["brachium.can_wearer", *words], stderr=folder / f"{name}.err")
            fault_ns = start_ns + round(FAULT_S * 1e9)
            time.sleep((fault_ns - time.monotonic_ns()) * 1e-9)
            told = _told(truth)
            fault_ns = _break(kind, services, nodes, fault_ns)
            time.sleep(AFTER_S)
        fault = f"{kind} {jump_deg:+.0f} deg" if jump_deg else kind
        return figures(fault, heard, clock.at(0), start_ns, fault_ns, told)


def _start(folder: Path, services: Processes, router: int, gateway: int, channel: int) -> None:
    entries = tuple(
        NodeEntry(
            id=node_id("p01", segment),
            token_sha256=token_sha256(TOKEN),
            subject="p01",
            segment=segment,
            mounting=wearer().info(segment).mounting,  # type: ignore[arg-type]
        )
        for segment in SEGMENTS
    )
    site, joints = folder / "site.toml", folder / "joints.toml"
    site.write_text(f'[room]\nid = "{ROOM}"\n\n[[subject]]\nid = "p01"\n\n{node_table(entries)}')
    joints.write_text('subject = "p01"\nside = "right"\n')
    network = ["--room", ROOM, "--endpoint", f"tcp/127.0.0.1:{router}"]
    can = ["--interface", "udp_multicast", "--channel", GROUP, "--port", str(channel), "--fd"]
    for name, words in {
        "router": ["router", "--room", ROOM, "--port", str(router)],
        "gateway": [
            "gateway",
            *network,
            "--port",
            str(gateway),
            "--discovery-port",
            "0",
            "--site",
            str(site),
        ],
        "fuse": ["fuse", *network],
        "can": ["can", *network, *can, "--out", str(joints), "--origin", "emulated"],
    }.items():
        services.start(name, words, stdout=folder / f"{name}.out", stderr=folder / f"{name}.err")


def _ready(bus: Bus) -> None:
    deadline, missing = time.monotonic() + 30.0, {"gateway", "fusion", "can"}
    while missing:
        missing -= {keys.parse(k).detail.split("/")[0] for k in bus.alive(keys.services(ROOM, "*/*/alive"))}
        if time.monotonic() > deadline:
            raise Failed(f"after 30 s there is still no {', '.join(sorted(missing))}")
        time.sleep(0.1)


@contextmanager
def _listening(port: int) -> Iterator[Frames]:
    """Hear the machine's side of the bus: by python-can and cantools alone."""
    import can
    from cantools import database

    from brachium_nodes.can import arm_frames

    dbc: Any = database.load_file(Path(arm_frames.__file__).with_name("brachium_arm.dbc"))
    message = dbc.get_message_by_name("RightArm")
    heard, stop = Frames(at_ns=[], read=[]), threading.Event()

    def listen() -> None:
        with can.Bus(interface="udp_multicast", channel=GROUP, port=port, hop_limit=0) as bus:
            while not stop.is_set():
                frame = bus.recv(0.1)
                if frame is not None and frame.arbitration_id == message.frame_id:
                    heard.at_ns.append(time.monotonic_ns())
                    heard.read.append(message.decode(bytes(frame.data), decode_choices=False))

    thread = threading.Thread(target=listen)
    thread.start()
    try:
        yield heard
    finally:
        stop.set()
        thread.join()


def _told(truth: Inbox) -> list[Skeleton]:
    return [decode(payload, Skeleton) for _, payload in truth.drain()]


def _break(kind: str, services: Processes, nodes: Processes, planned_ns: int) -> int:
    """Break it; return when it broke, by the monotonic clock."""
    if kind in ("jump", "field turned"):
        return planned_ns  # the first sample with the other heading, or field
    where, name = {
        "node killed": (nodes, "node-forearm_r"),
        "fusion killed": (services, "fuse"),
        "router killed": (services, "router"),
    }[kind]
    process = where.children[name].process
    assert process is not None
    process.kill()
    return time.monotonic_ns()
