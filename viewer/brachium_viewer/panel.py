"""The words beside the picture, as Markdown: whose arm it is, what it rests on, how its sensors fare."""

import re
from collections.abc import Mapping

from brachium_wire.battery import is_low
from brachium_wire.messages import Calibration, Forward, Origin, Skeleton, Status

NOT_A_DEVICE = "Brachium is a measuring and research tool, not a medical device."
LONGEST = 200
"""Characters of one remark; a longer one is cut."""
MOST = 8
"""Warnings that are shown."""
ORIGIN: Mapping[Origin, str] = {
    "worn": "worn by a person",
    "emulated": "EMULATED WEARER, nobody is measured",
    "playback": "PLAYBACK of a recording, not live",
}
WAITING = (
    "### Waiting for skeletons\n\n"
    "None has come yet. `brachium monitor` shows which services and sensors are there."
)
SHORT_ORIGIN: Mapping[Origin, str] = {"worn": "", "emulated": "emulated wearer", "playback": "playback"}
FORWARD: Mapping[Forward, str] = {
    "sternum": "from the sternum sensor",
    "elbow": "from the elbow's axis",
    "facing": "from the stated facing, by magnetometer",
    "mounting": "from how the upper arm's sensor is worn",
    "none": "**not known**: assumed",
}


def plain(text: str) -> str:
    """Return words from the network such that Markdown takes them for words: no link, picture or heading."""
    short = " ".join(text.split())
    short = short if len(short) <= LONGEST else short[:LONGEST] + "…"
    return re.sub(r"([!-$&-*/<-@[-`{-~])", r"\\\1", short)  # ASCII alone: before others a backslash is shown


def describe(
    subject: str,
    skeletons: Mapping[str, Skeleton],
    calibration: Calibration | None,
    statuses: Mapping[str, Status],
    *,
    silent: bool,
) -> str:
    """Return the panel of one subject; `skeletons` by side, `statuses` by segment."""
    newest = next(iter(skeletons.values()))
    lines = [f"### {plain(subject)}: {ORIGIN[newest.origin]}", ""]
    if silent:
        lines.append("**No skeleton arrives any more.** The last pose is shown in grey.\n")
    lines.append(f"- Forward: {FORWARD[newest.forward]}")
    lines.append(f"- Calibration: {_calibration(calibration)}")
    assumed = sorted({name for skeleton in skeletons.values() for name in skeleton.assumed})
    if assumed:
        lines.append(f"- Not plainly measured: {plain(', '.join(assumed).replace('_', ' '))}")
    lines += [f"- {plain(warning)}" for warning in (calibration.warnings[:MOST] if calibration else [])]
    if statuses:
        lines += ["", "| sensor | samples/s | lost | battery | signal |", "|---|---|---|---|---|"]
        lines += [_sensor(segment, statuses[segment]) for segment in sorted(statuses)]
    return "\n".join(lines)


def key(colours: Mapping[tuple[str, str], str], *, truth: bool) -> str:
    """Return what the plots' lines mean; `colours` names the colour of each (subject, side)."""
    lines = [f"{colour} = {plain(subject)} {side}" for (subject, side), colour in colours.items()]
    lines += ["broad pale = what the wearer really does"] if truth else []
    return f"Plots: {', '.join(lines)}, grey = AAOS reference."


def _calibration(calibration: Calibration | None) -> str:
    if calibration is None or calibration.state == "none":
        return "**none yet**"
    text = {
        "waiting": "waiting",
        "running": f"running, {100 * calibration.progress:.0f} %",
        "done": "done",
        "refused": "**refused**",
    }[calibration.state]
    if calibration.pose:
        text += f" ({plain(calibration.pose)})"
    return text + (f": {plain(calibration.reason)}" if calibration.reason else "")


def _battery(status: Status) -> str:
    volts = "–" if status.battery_v is None else f"{status.battery_v:.2f} V"
    if status.battery_hours is None or not is_low(status.battery_hours):
        return volts
    return f"**low: {60 * status.battery_hours:.0f} min left**"


def _sensor(segment: str, status: Status) -> str:
    name = plain(segment.replace("_", " "))
    asked = status.received + status.lost
    lost = f"{100 * status.lost / asked:.2f} %" if asked else "–"
    cells = (
        name if status.connected else f"**{name}: gone**",
        "–" if status.rate_hz is None else f"{status.rate_hz:.0f}",
        lost,
        _battery(status),
        "–" if status.rssi_dbm is None else f"{status.rssi_dbm:.0f} dBm",
    )
    return "| " + " | ".join(cells) + " |"
