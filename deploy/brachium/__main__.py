"""The command line. Here is only the table of commands: each is a module that is loaded when it is called."""

import sys
from importlib import import_module

COMMANDS: dict[str, str] = {
    "demo": "the whole network on this machine: live view, recording, summary",
    "up": "every service that a site file names, watched and restarted",
    "router": "the room's Zenoh router",
    "gateway": "the door for wearables (WebSocket): it assigns nodes to subjects and segments",
    "slimevr": "the door for SlimeVR trackers (UDP): those that are named come in as nodes",
    "shimmer": "a Shimmer3 over its serial port, as a node of its own",
    "can": "a CAN bus: inertial sensors on it come in, joint angles for a machine go out",
    "emulate": "an emulated wearer, through the gateway or straight to the bus",
    "play": "a capture folder or a recording, as if it were being measured now",
    "fuse": "fusion: samples to skeletons",
    "calibrate": "calibrate a person's sensors in a running network: it says what to do",
    "wear-check": "which sensor sits where, and whether it is turned: it says what to change",
    "view": "the live view",
    "web": "the therapist's and the patient's page, for tablets and browsers",
    "record": "the recorder",
    "lsl": "the room as Lab Streaming Layer streams, markers back as events; taps that a camera sees",
    "monitor": "the network in the terminal: nodes, rates, loss, latency",
    "sensor": "fit a sensor's own calibration from a recording, and keep it for the gateway",
    "conformance": "try any node from outside against the rules of the node protocol",
    "firmware": "compile the wearables' firmware, or run it on this machine",
    "solve": "a capture folder or a recording to angles, positions and orientations",
    "report": "a session for its therapist: one page that prints, and a table of repetitions",
    "sessions": "subjects and their sessions: list, show, add, export, import, delete",
    "compare": "error statistics between two results",
    "export": "a recording or a result as a file that OpenSim, Mokka, Blender or a spreadsheet opens",
    "evaluate": "the accuracy tables: both papers' experiments, and real recordings",
    "doctor": "what works on this machine, what does not, and what to do",
    "bench": "the performance figures of this machine",
    "prove": "measure every figure that is promised, into a folder of JSON files",
}


def main(argv: list[str] | None = None) -> int:
    """Run one command; return 0, 2 for usage and bad input, or 1 when it failed while running."""
    words = sys.argv[1:] if argv is None else argv
    if not words or words[0] in ("-h", "--help"):
        print(_help())
        return 0
    if words[0] == "--version":
        from brachium.version import version

        print(version())
        return 0
    if words[0] not in COMMANDS:
        print(_unknown(words[0]), file=sys.stderr)
        return 2
    from brachium.shell import run_command

    module = import_module(f"brachium.commands.{words[0].replace('-', '_')}")
    return run_command(words[0], COMMANDS[words[0]], module, words[1:])


def _help() -> str:
    rows = "\n".join(f"  {name:<12}{text}" for name, text in COMMANDS.items())
    return (
        "usage: brachium COMMAND [options]\n\n"
        "Upper-limb motion tracking with small wireless inertial sensors.\n\n"
        f"commands:\n{rows}\n\n"
        "first look:    brachium demo\n"
        "one command:   brachium COMMAND --help\n"
        "this version:  brachium --version\n\n"
        "A measuring and research tool, not a medical device."
    )


def _unknown(word: str) -> str:
    from difflib import get_close_matches

    near = get_close_matches(word, COMMANDS, n=1)
    hint = f"did you mean {near[0]!r}?" if near else "see: brachium --help"
    return f"brachium: no command {word!r}; {hint}"


if __name__ == "__main__":
    sys.exit(main())
