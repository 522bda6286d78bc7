"""Cards for people and programs: text, Markdown, JSON, pictures."""

import json
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from ..common import files
from . import chart
from .card import Card
from .line import Limit, Value
from .lines import LINES
from .motion import SAMPLE_PERIOD
from .tables import ROBUSTNESS, TABLES

RULE = """\
Order of a step: the contact states of Table 2 between two swaps of the legs are exactly
3-7-15-16-14, and the swap leads back to 3. Visits shorter than 2 ms are left out; consecutive
visits of one state are one. A second count takes state 1 (the supporting foot sticks) as state 3
(it slides)."""
SCOPE = f"""\
All figures are over the complete steps, from the first swap of the legs to the last. Forces,
torques, rates and heights are sampled every {1e3 * SAMPLE_PERIOD:g} ms. An asterisk marks a value that does not meet
the requirement on the paper's gait; the other limits are those of a human."""  # noqa: E501
_NONE, _ZERO = "-", 1e-5


def summary(cards: Sequence[Card]) -> dict[str, Any]:
    """Lay cards out for programs; None for a value that a gait does not have."""
    return {
        "rule": " ".join(RULE.split()),
        "lines": {
            line.key: {
                "name": line.name,
                "unit": line.unit,
                "definition": line.definition,
                "required": line.required and str(line.required),
                "human": line.human and str(line.human),
            }
            for line in (*LINES, *TABLES, *ROBUSTNESS)
        },
        "cards": {card.name: _summary_of(card) for card in cards},
    }


def _summary_of(card: Card) -> dict[str, Any]:
    recording = card.motion.recording
    values: dict[str, Value] = {**card.numbers, **card.tables, **card.robustness}
    met: dict[str, dict[str, bool]] = {"required": {}, "human": {}}
    for line in (*LINES, *ROBUSTNESS):
        for kind, limit in (("required", line.required), ("human", line.human)):
            if limit is not None:
                met[kind][line.key] = limit.met(values[line.key])
    return {
        "accuracy": card.motion.scene.get("accuracy"),
        "steps_asked": card.motion.asked,
        "steps_made": int(recording.steps.size),
        "complete_steps": len(card.motion.orders),
        "termination": recording.metadata["termination"],
        "values": {key: _plain(value) for key, value in values.items()},
        "met": met,
    }


def _plain(value: Value) -> Any:
    if isinstance(value, dict):
        return {name: _plain(x) for name, x in value.items()}
    return value if math.isfinite(value) else None


def text(cards: Sequence[Card]) -> str:
    """Lay cards out for a terminal."""
    blocks = [RULE, SCOPE, _aligned(_main_rows(cards))]
    for card in cards:
        blocks += [_ending(card), *map(_aligned, _detail_rows(card))]
    return "\n\n".join(blocks)


def markdown(cards: Sequence[Card], command: str) -> str:
    """Lay cards out for a document, next to the pictures that `write` makes."""
    blocks = [
        "# Cards of gaits",
        f"Written by `{command}`.",
        RULE,
        SCOPE,
        _piped(_main_rows(cards)),
    ]
    for card in cards:
        blocks += [f"## {card.name}", _ending(card)]
        if card.motion.orders:
            blocks.append(f"![One step of {card.name}]({_picture(card)})")
        blocks += map(_piped, _detail_rows(card))
    definitions = (*LINES, *TABLES, *ROBUSTNESS)
    rows = [["line", "unit", "definition"]]
    rows += [[line.name, line.unit, line.definition] for line in definitions]
    blocks += ["## Definitions", _piped(rows)]
    return "\n\n".join(blocks) + "\n"


def write(cards: Sequence[Card], folder: Path, command: str) -> None:
    """Write gaits.md, gaits.json and a picture of one step per card into a folder."""
    data = json.dumps(summary(cards), allow_nan=False, indent=1)
    pictures = {
        folder / _picture(card): files.png(chart.one_step(card), dpi=130)
        for card in cards
        if card.motion.orders
    }
    texts = {"gaits.md": markdown(cards, command), "gaits.json": data + "\n"}
    files.write_all(pictures | {folder / name: text.encode() for name, text in texts.items()})


def _picture(card: Card) -> str:
    return f"gait_{files.plain_name(card.name)}.png"


def _main_rows(cards: Sequence[Card]) -> list[list[str]]:
    """Rows of the table of all cards: requirements, then a column for each card."""
    rows = [["", "required", "human", *(card.name for card in cards)]]
    for line in LINES:
        cells = [_marked(card.numbers[line.key], line.required) for card in cards]
        rows.append([line.title, _limit(line.required), _limit(line.human), *cells])
    for check in ROBUSTNESS:
        for accuracy in cards[0].runs:
            cells = [
                _marked(card.robustness[check.key][accuracy], check.required) for card in cards
            ]
            title = f"{check.title}, {accuracy}"
            rows.append([title, _limit(check.required), _limit(check.human), *cells])
    return rows


def _detail_rows(card: Card) -> list[list[list[str]]]:
    """Tables of one card: contact states, ends of the soles, joints."""
    tables = []
    for kind in dict.fromkeys(line.rows for line in TABLES):
        lines = [line for line in TABLES if line.rows == kind]
        columns: list[Mapping[str, float]] = [card.tables[line.key] for line in lines]
        rows = [[str(kind), *(line.title for line in lines)]]
        for name in columns[0]:
            rows.append([name, *(_number(column.get(name, 0.0)) for column in columns)])
        tables.append(rows)
    return [rows for rows in tables if len(rows) > 1]


def _ending(card: Card) -> str:
    recording = card.motion.recording
    made = f"{card.name}: {recording.steps.size} of {card.motion.asked} steps"
    cause = recording.metadata["termination"]
    return made + (f", ended by {cause} after {card.motion.samples.t[-1]:.2f} s." if cause else ".")


def _limit(limit: Limit | None) -> str:
    return "" if limit is None else str(limit)


def _marked(value: float, limit: Limit | None) -> str:
    missed = limit is not None and not limit.met(value)
    return _number(value) + ("*" if missed else "")


def _number(value: float) -> str:
    if not math.isfinite(value):
        return _NONE
    # Torques have the rounding errors of single precision.
    if abs(value) < _ZERO or value == round(value) or abs(value) >= 1e3:
        return f"{abs(value) if abs(value) < _ZERO else value:.0f}"
    return f"{value:.3g}"


def _aligned(rows: Sequence[Sequence[str]]) -> str:
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    return "\n".join(
        "  ".join(
            cell.rjust(width) if i else cell.ljust(width)
            for i, (cell, width) in enumerate(zip(row, widths, strict=True))
        ).rstrip()
        for row in rows
    )


def _piped(rows: Sequence[Sequence[str]]) -> str:
    escaped = [[cell.replace("*", "\\*").replace("|", "\\|") for cell in row] for row in rows]
    lines = ["| " + " | ".join(row) + " |" for row in escaped]
    return "\n".join([lines[0], "|---" * len(rows[0]) + "|", *lines[1:]])
