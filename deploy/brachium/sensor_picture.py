"""What a person sees of a sensor's calibration: a picture for a terminal, or plain lines. Pure."""

from typing import Any

from brachium_wire.sensor_records import SensorProgress

BAR = 20
FACES = ("+x", "-x", "+y", "-y", "+z", "-z")
BANDS = 6


def picture(progress: SensorProgress) -> list[str]:
    """Return the step as it stands, line by line."""
    steps = progress.steps or [progress.step]
    number = steps.index(progress.step) + 1 if progress.step in steps else 1
    again = f", attempt {progress.attempt}" if progress.attempt > 1 else ""
    lines = [f"{progress.segment}: step {number} of {len(steps)}, {progress.step}{again}"]
    lines += [f"refused: {why}" for step, why in progress.refused.items() if step == progress.step]
    lines += [progress.reason, *_step(progress)]
    return lines


def _step(progress: SensorProgress) -> list[str]:
    still = f"  lies still, {progress.left_s:.1f} s more" if progress.left_s else "  lies still: good"
    if progress.step == "turn":
        cells = progress.cells or "." * 48
        size = len(cells) // BANDS
        rows = [" ".join(cells[k * size : (k + 1) * size]) for k in range(BANDS)]
        ends = {0: "  +z", BANDS - 1: "  -z"}
        more = f", {progress.left_s:.0f} s more" if progress.left_s else ""
        return [f"  {bar(progress.coverage)} of all directions{more}"] + [
            f"{ends.get(k, ''):<6}{row}" for k, row in enumerate(rows)
        ]
    if progress.step == "faces":
        ticks = "   ".join(f"[{'x' if face in progress.faces else ' '}] {face}" for face in FACES)
        return [f"  {ticks}", still if progress.still else "  moves"]
    return [still if progress.still else "  moves"]


def bar(share: float) -> str:
    """Return a share as a bar and per cent."""
    full = round(share * BAR)
    return f"[{'#' * full}{'.' * (BAR - full)}] {100.0 * share:3.0f} %"


def line(progress: SensorProgress) -> str:
    """Return what has come so far in one line that changes only with what is worth a new one."""
    again = f", attempt {progress.attempt}" if progress.attempt > 1 else ""
    words = f"{progress.step}{again}: {progress.reason}"
    if progress.step == "turn":
        words += f" ({10 * int(10.0 * progress.coverage)} % of all directions)"
    return words


def found(data: dict[str, Any], kept: str) -> list[str]:
    """Return what a finished calibration has found, and who keeps it."""
    lines = []
    if data.get("calibration"):
        lines.append(f"{data['segment']} ({data['node']}):")
        lines += [f"  {_name(name)} {value:.3g}" for name, value in sorted(data["scores"].items())]
    lines += [f"not calibrated, {step}: {why}" for step, why in data.get("refused", {}).items()]
    if data.get("calibration"):
        lines.append(
            {
                "node": f"kept on the node {data['node']}",
                "gateway": "kept by the gateway: this node's program does not keep calibrations",
            }.get(kept, "no gateway has taken it yet: the node gets it when it joins one of this room")
        )
        lines.append("once it is worn: brachium calibrate, without --sensor")
    return lines


_UNITS = {"dps": "deg/s", "m_s2": "m/s^2", "ut": "uT", "s": "s"}


def _name(score: str) -> str:
    for ending, unit in _UNITS.items():
        if score.endswith(f"_{ending}"):
            return f"{score.removesuffix(f'_{ending}').replace('_', ' ')}, {unit}:"
    return f"{score.replace('_', ' ')}:"
