"""brachium lsl as a user types it: streams of an emulated room, taps in a recording, and what is missing."""

import json
import subprocess
import sys
import time
from typing import Any

import numpy as np
import pytest

from brachium.processes import Processes
from brachium_wire import keys, recording
from brachium_wire.codec import encode
from brachium_wire.samples import write_samples

WITHIN_S = 60.0
START = 1_790_000_000_000_000_000
HIDDEN = "import sys; sys.modules['pylsl'] = None\n"
BROKEN = """
import builtins
real = builtins.__import__
def without(name, *rest, **more):
    if name.startswith("pylsl"):
        raise RuntimeError("LSL binary library file was not found.\\nAnd so on.")
    return real(name, *rest, **more)
builtins.__import__ = without
"""


@pytest.mark.parametrize(("spell", "says"), [(HIDDEN, "pip install 'brachium[lsl]'"), (BROKEN, "PYLSL_LIB")])
def test_what_is_missing_is_told_in_one_line(spell, says):
    program = f"{spell}\nimport sys\nfrom brachium.__main__ import main\nsys.exit(main(['lsl']))"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert (done.returncode, len(done.stderr.splitlines())) == (1, 1), done.stderr
    assert says in done.stderr


@pytest.fixture(scope="module")
def tapped(tmp_path_factory: pytest.TempPathFactory) -> str:
    """A recording of a sensor at rest that is tapped 2.0, 2.3 and 2.7 s after its first sample."""
    path = tmp_path_factory.mktemp("taps") / "a.mcap"
    acc = np.tile([0.0, 9.81, 0.0], (500, 1))
    for at in (200, 230, 270):
        acc[at, 0] += 30.0
    with recording.RecordingWriter(path) as writer:
        for first in range(0, 500, 10):
            times = START + 10_000_000 * np.arange(first, first + 10)
            batch = write_samples(
                sequence=first,
                time_ns=times,
                device_us=(times - START) // 1000,
                received_ns=int(times[-1]),
                uncertainty_ns=0,
                acc=acc[first : first + 10],
                gyr=np.zeros((10, 3)),
            )
            writer.write(keys.imu("lab", "p01", "forearm_r"), encode(batch), batch.received_ns)
    return str(path)


def test_taps_in_a_recording_give_the_cameras_lag(brachium, tapped):
    done = brachium("lsl", "--taps", tapped, "--camera", "12.48", "--json")
    (found,) = json.loads(done.stdout)
    assert (found["subject"], found["segment"]) == ("p01", "forearm_r")
    assert (found["first_s"], found["camera_lag_s"]) == pytest.approx((2.0, 10.48))
    assert [t - START for t in found["times_ns"]] == [2_000_000_000, 2_300_000_000, 2_700_000_000]
    text = brachium("lsl", "--taps", tapped, "--camera", "12.48").stdout
    assert text == (
        "p01 forearm_r: tapped at 2.000 s from the first sample, then after 0.300 and 0.400 s; "
        "camera time = time from the first sample +10.480 s\n"
    )


@pytest.mark.parametrize(
    ("words", "code", "says"),
    [
        (["--camera", "3"], 2, "--taps"),
        (["--taps", "nothing.mcap"], 2, "nothing.mcap"),
        (["--taps", "{tapped}", "--subject", "p02"], 1, "tapped three times"),
        (["--scope", "world"], 2, "machine"),
    ],
)
def test_what_cannot_be_done_is_told(brachium, tapped, words, code, says):
    done = brachium("lsl", *(word.replace("{tapped}", tapped) for word in words))
    assert (done.returncode, done.stdout) == (code, "")
    assert says in done.stderr


@pytest.mark.network
def test_an_emulated_room_is_found_and_read_by_another_lsl_program(
    processes: Processes, router_endpoint: str
):
    from brachium_viewer.lsl.library import NoLsl, load

    try:
        pylsl: Any = load("machine")
    except (ModuleNotFoundError, NoLsl) as error:
        pytest.skip(f"LSL is not there: {error}")
    network = ["--endpoint", router_endpoint]
    processes.start("fuse", ["fuse", *network, "--no-keep"])
    processes.start("lsl", ["lsl", *network])
    processes.start("emulate", ["emulate", *network, "--subject", "lsltest"])
    deadline = time.monotonic() + WITHIN_S
    times = {}
    for what in ("right skeleton", "right angles", "hand_r samples"):
        found = pylsl.resolve_byprop("name", f"lsltest {what} (emulated)", 1, deadline - time.monotonic())
        assert found, what
        inlet = pylsl.StreamInlet(found[0])
        rows: list[Any] = []
        at: list[float] = []
        while len(at) < 60 or at[-1] < pylsl.local_clock() - 2.0:  # by the clock of LSL, and of now
            assert time.monotonic() < deadline, (what, at[-1:], pylsl.local_clock())
            more, when = inlet.pull_chunk(timeout=0.2)
            rows += more
            at += when
        times[what] = np.array(at)
        assert np.all(np.diff(times[what]) > 0.0)
        assert at[-1] < pylsl.local_clock() + 2.0
        assert len(rows[0]) == found[0].channel_count()
    ticks = np.diff(times["right skeleton"])
    assert np.median(ticks) == pytest.approx(0.02, abs=1e-6)
    assert np.median(np.diff(times["hand_r samples"])) == pytest.approx(0.01, abs=1e-4)
