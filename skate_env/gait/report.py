"""Gaits as a table for people and as JSON for programs, with a picture of a step of each."""

import json
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from ..common import files
from . import chart, contact
from .motion import SAMPLE_PERIOD, Motion
from .quantities import QUANTITIES

RULE = """\
Order of a step: the contact states of Table 2 between two swaps of the legs are exactly
3-7-15-16-14, and the swap leads back to 3. Visits shorter than 2 ms are left out; consecutive
visits of one state are one. A second count takes state 1 (the supporting foot sticks) as state 3
(it slides)."""
SCOPE = f"""\
All figures are over the complete steps, from the first swap of the legs to the last. Forces,
torques, rates and heights are sampled every {1e3 * SAMPLE_PERIOD:g} ms."""
_NONE, _ZERO = "-", 1e-5


def values(motion: Motion) -> dict[str, float | None]:
    """Values of `QUANTITIES` by key; None for one that the motion does not have."""
    found = {each.key: each.measure(motion) for each in QUANTITIES}
    return {key: value if math.isfinite(value) else None for key, value in found.items()}


def summary(motions: Mapping[str, Motion]) -> dict[str, Any]:
    """Lay motions out for programs, by name."""
    return {
        "rule": " ".join(RULE.split()),
        "quantities": {
            each.key: {"name": each.name, "unit": each.unit, "definition": each.definition}
            for each in QUANTITIES
        },
        "gaits": {name: _summary_of(motion) for name, motion in motions.items()},
    }


def _summary_of(motion: Motion) -> dict[str, Any]:
    return {
        "accuracy": motion.scene.get("accuracy"),
        "steps_asked": motion.asked,
        "steps_made": int(motion.recording.steps.size),
        "complete_steps": len(motion.orders),
        "termination": motion.recording.metadata["termination"],
        "values": values(motion),
        "sequences": contact.sequences(motion),
        "ms_in_state": contact.dwell(motion),
        "joint_torques": motion.torques,
    }


def text(motions: Mapping[str, Motion]) -> str:
    """Lay motions out for a terminal: the rule, the sequences, and one table."""
    made = "\n".join(sequences(name, motion) for name, motion in motions.items())
    return "\n\n".join([RULE, SCOPE, made, _table(motions)])


def sequences(name: str, motion: Motion) -> str:
    """Say how many steps a motion has, why it ends, and the sequences of their contact states."""
    recording = motion.recording
    line = f"{name}: {recording.steps.size} of {motion.asked} steps"
    if cause := recording.metadata["termination"]:
        line += f", ended by {cause} after {recording.t[-1]:.2f} s"
    shares = contact.sequences(motion)
    for states, share in list(shares.items())[:3]:
        line += f"\n  {states}: {share:.0%} of the steps"
    return line


def _table(motions: Mapping[str, Motion]) -> str:
    """One column for each motion."""
    columns = [values(motion) for motion in motions.values()]
    rows = [["", *motions]]
    rows += [[each.title, *(number(column[each.key]) for column in columns)] for each in QUANTITIES]
    dwell = [contact.dwell(motion) for motion in motions.values()]
    for state in sorted({int(state) for times in dwell for state in times}):
        cells = [number(times.get(str(state), 0.0)) for times in dwell]
        rows.append([f"time per step in state {state} [ms]", *cells])
    return aligned(rows)


@files.own_style
def write(motions: Mapping[str, Motion], folder: Path) -> None:
    """Write gaits.json and a picture of one step of each motion into a folder."""
    data = json.dumps(summary(motions), allow_nan=False, indent=1) + "\n"
    files.write_all(pictures(motions, folder) | {folder / "gaits.json": data.encode()})


def pictures(motions: Mapping[str, Motion], folder: Path) -> dict[Path, bytes]:
    """Draw one step of each motion that has one; contents of the files by path."""
    return {
        folder / picture(name): files.png(chart.one_step(name, motion), dpi=130)
        for name, motion in motions.items()
        if motion.orders
    }


def picture(name: str) -> str:
    """Name of the picture of a gait."""
    return f"gait_{files.plain_name(name)}.png"


def number(value: float | None) -> str:
    """Format a number with three digits."""
    if value is None or not math.isfinite(value):
        return _NONE
    # Torques have the rounding errors of single precision.
    if abs(value) < _ZERO or value == round(value) or abs(value) >= 1e3:
        return f"{abs(value) if abs(value) < _ZERO else value:.0f}"
    return f"{value:.3g}"


def aligned(rows: Sequence[Sequence[str]]) -> str:
    """Align the columns of a table."""
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    return "\n".join(
        "  ".join(
            cell.rjust(width) if i else cell.ljust(width)
            for i, (cell, width) in enumerate(zip(row, widths, strict=True))
        ).rstrip()
        for row in rows
    )
