"""Switches an emulated board on and starts its firmware: python -m ... FOLDER INTERPRETER...

The interpreter runs in the board's folder, its serial line is this process's input and output. SIGTERM
interrupts the firmware as Ctrl-C on that line does. When the firmware ends, the report is in `report.json`.
"""

import contextlib
import json
import signal
import socket
import struct
import subprocess
import sys
from dataclasses import asdict
from pathlib import Path

from brachium_nodes.emulated_board.board import QUESTION, Board, pause_ms, true_us
from brachium_nodes.emulated_board.settings import read_board

REPORT = "report.json"
_ENDS_WITHIN_S = 5.0


def run(folder: Path, words: list[str]) -> int:
    """Run the firmware by these words until it ends other than by a reset; return its exit code."""
    settings, feed = read_board(folder)
    board = Board(settings=settings, feed=feed, clock=true_us, pause=pause_ms)

    running: list[subprocess.Popen[bytes]] = []

    def stop(*_: object) -> None:
        board.stopped = True
        if not board.watched:
            running[-1].terminate()  # nothing is lost: it takes no samples

    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the interpreter takes it: both are in one terminal
    told = [settings.ticks_ppm, settings.ticks_shift_us, settings.send_buffer, settings.web_port]
    code = 0
    while True:
        here, there = socket.socketpair()
        with here, there:
            line = [*words, str(there.fileno()), *map(str, told)]
            running.append(subprocess.Popen(line, cwd=folder, pass_fds=[there.fileno()]))
            signal.signal(signal.SIGTERM, stop)
            there.close()
            again = serve(board, here)
        code = _ended(running[-1])
        if not again or board.stopped:
            break
        board.counts.restarts += 1
        board.reset()
    (folder / REPORT).write_text(json.dumps(asdict(board.report())), encoding="utf-8")
    return 0 if board.stopped and code == -signal.SIGTERM else code


def serve(board: Board, line: socket.socket) -> bool:
    """Answer until the interpreter hangs up; return whether the firmware asked for a reset."""
    again = False
    with contextlib.suppress(ConnectionError):
        while question := _exactly(line, QUESTION):
            if question[:1] == b"h":
                board.note(*struct.unpack("<III", _exactly(line, 12)))
                line.sendall(b"\0")
            elif question[:1] == b"z":
                again = True
                line.sendall(b"\0")
            else:
                line.sendall(board.answer(question))
    return again


def _exactly(line: socket.socket, size: int) -> bytes:
    """Return so many bytes, or none when the other side has hung up."""
    data = b""
    while len(data) < size:
        more = line.recv(size - len(data))
        if not more:
            return b""
        data += more
    return data


def _ended(process: "subprocess.Popen[bytes]") -> int:
    try:
        return process.wait(_ENDS_WITHIN_S)
    except subprocess.TimeoutExpired:
        process.kill()
        return process.wait()


if __name__ == "__main__":
    sys.exit(run(Path(sys.argv[1]), sys.argv[2:]))
