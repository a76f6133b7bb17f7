import signal
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from brachium.processes import FIRST_PAUSE_S, LONGEST_PAUSE_S, STEADY_S, Processes

SLEEP = "import time\ntime.sleep(60)"
STUBBORN = (
    "import signal, time\nsignal.signal(signal.SIGTERM, signal.SIG_IGN)\n"
    "print('up', flush=True)\ntime.sleep(60)"
)


class Time:
    """A clock that the test moves."""

    now = 1000.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def time():
    return Time()


@pytest.fixture
def children(time: Time):
    with Processes(command=(sys.executable, "-c"), clock=time) as processes:
        yield processes


def kill(processes: Processes, name: str) -> None:
    process = processes.children[name].process
    assert process is not None
    process.kill()
    process.wait()


def test_a_killed_child_is_started_again_after_its_pause(children: Processes, time: Time):
    child = children.start("one", [SLEEP])
    first = child.process.pid
    assert children.ended() == []
    kill(children, "one")
    assert [c.name for c in children.ended()] == ["one"]
    assert children.revive() == []  # seen; its pause begins
    time.now += 0.9 * FIRST_PAUSE_S
    assert children.revive() == []
    time.now += 0.2 * FIRST_PAUSE_S
    assert children.revive() == [child]
    assert child.alive()
    assert child.process.pid != first
    assert child.starts == 2


def test_pauses_double_up_to_the_longest_and_a_steady_run_forgives(children: Processes, time: Time):
    child = children.start("one", [SLEEP])
    pauses = []
    for _ in range(8):
        kill(children, "one")
        children.revive()
        pauses.append(child.due_s - time.now)
        time.now = child.due_s
        assert children.revive() == [child]
    assert pauses == pytest.approx([min(FIRST_PAUSE_S * 2**n, LONGEST_PAUSE_S) for n in range(8)])
    time.now += STEADY_S
    kill(children, "one")
    children.revive()
    assert child.due_s - time.now == pytest.approx(FIRST_PAUSE_S)


@pytest.mark.parametrize(
    ("code", "came_up", "expected"),
    [(2, True, True), (2, False, True), (1, False, True), (0, False, True), (1, True, False)],
)
def test_what_refuses_its_input_or_never_came_up_is_hopeless(
    children: Processes, code: int, came_up: bool, expected: bool
):
    children.start("other", [SLEEP])
    child = children.start("one", [f"raise SystemExit({code})"])
    child.came_up = came_up
    assert child.process.wait(60) == code
    assert children.hopeless() is (child if expected else None)


def test_a_killed_one_is_not_hopeless(children: Processes):
    children.start("one", [SLEEP])
    kill(children, "one")
    assert children.hopeless() is None


def test_the_others_run_on_while_one_is_down(children: Processes, time: Time):
    other = children.start("other", [SLEEP])
    children.start("one", [SLEEP])
    pid = other.process.pid
    kill(children, "one")
    children.revive()
    time.now += 1.0
    children.revive()
    assert other.alive()
    assert other.process.pid == pid
    assert other.starts == 1


def test_all_are_ended_last_first(children: Processes, tmp_path: Path):
    note = tmp_path / "order"
    code = (
        "import signal, sys, time\n"
        f"def end(*_):\n    open({str(note)!r}, 'a').write(sys.argv[1])\n    sys.exit(0)\n"
        "signal.signal(signal.SIGTERM, end)\nprint('up', flush=True)\ntime.sleep(60)"
    )
    for name in "abc":
        out = tmp_path / name
        child = children.start(name, [code, name], stdout=out)
        wait_for_output(out)
        assert child.alive()
    children.close()
    assert note.read_text() == "cba"
    assert children.children == {}


def test_one_that_does_not_end_is_killed(
    children: Processes, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr("brachium.processes.END_S", 0.2)
    out = tmp_path / "out"
    children.start("one", [STUBBORN], stdout=out)
    wait_for_output(out)
    assert children.end("one") == -signal.SIGKILL


def test_its_last_words_are_kept(children: Processes, tmp_path: Path):
    err = tmp_path / "err"
    child = children.start("one", ["import sys; sys.exit('first\\nport 7447 is taken')"], stderr=err)
    assert child.process.wait(60) == 1
    assert child.complaint() == "port 7447 is taken"


def test_a_service_does_not_outlive_who_started_it():
    """Its parent was killed, so nobody can end it: it ends by itself, and closes its output."""
    code = (
        "import subprocess, sys\nfrom pathlib import Path\nfrom brachium.checks import free_port\n"
        "from brachium.processes import Processes\n"
        "p = Processes()\nc = p.start('router', ['router', '--port', str(free_port())])\n"
        "print(c.process.pid, flush=True)\nsys.stdin.read()"
    )
    parent = subprocess.Popen(
        [sys.executable, "-c", code], stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE
    )
    assert parent.stdout is not None
    assert parent.stderr is not None
    assert int(parent.stdout.readline()) > 0
    assert b"routing" in parent.stderr.readline()
    parent.kill()
    assert b"ended" in parent.stderr.read()  # end of file: the service has closed what it inherited
    parent.wait()
    parent.communicate()


def wait_for_output(path: Path) -> None:
    waited = threading.Event()
    for _ in range(600):
        if path.exists() and path.stat().st_size:
            return
        waited.wait(0.05)
    raise AssertionError(f"{path} stayed empty for 30 s")
