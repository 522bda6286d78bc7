"""Sensitivities for people and programs: text, Markdown, JSON, a picture."""

import json
import math
import textwrap
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from skate_env.common import files, literal

from .study import QUANTITIES, Sensitivity

_SCOPE = """\
Each number is the relative change of a quantity per relative change of a parameter: at +2, one
percent more of the parameter is two percent more of the quantity. Beside it stands its deviation
from central differences of the motion, - where every change of the parameter changes the sequence
of events or leaves the parameter's range."""
_WIDTH = 100
# Rows of the picture.
_SHOWN = 16
# Largest deviation that counts as agreement, relative to the largest number of the quantity.
_AGREES = 1e-5


def ranked(found: Sensitivity) -> list[int]:
    """Columns by the largest effect on any quantity, largest first."""
    order: list[int] = np.argsort(-np.abs(found.relative).max(axis=0), kind="stable").tolist()
    return order


def summary(found: Sensitivity) -> dict[str, Any]:
    """Lay the result out for programs, parameters in the order of `ranked`."""
    names, values = list(found.parameters), list(found.parameters.values())
    return {
        "scene": found.scene.name,
        "step": found.steps,
        "quantities": {
            name: {"value": value, "unit": unit}
            for (name, unit), value in zip(QUANTITIES.items(), found.values.tolist(), strict=True)
        },
        "parameters": {
            names[column]: {
                "value": values[column],
                "derivative": _by_quantity(found.derivatives[:, column]),
                "relative": _by_quantity(found.relative[:, column]),
                "error": _by_quantity(found.errors[:, column]),
            }
            for column in ranked(found)
        },
        "nonsmooth": [list(reason) for reason in found.nonsmooth],
    }


def _by_quantity(column: np.ndarray[Any, Any]) -> dict[str, float | None]:
    numbers = (x if math.isfinite(x) else None for x in column.tolist())
    return dict(zip(QUANTITIES, numbers, strict=True))


def _rows(found: Sensitivity) -> list[list[str]]:
    names, values = list(found.parameters), list(found.parameters.values())
    rows = [["parameter", "value", *(cell for name in QUANTITIES for cell in (name, "error"))]]
    for column in ranked(found):
        cells = [names[column], f"{values[column]:.5g}"]
        for number, error in zip(found.relative[:, column], found.errors[:, column], strict=True):
            cells += [f"{number:+.4f}", f"{error:.0e}" if math.isfinite(error) else "-"]
        rows.append(cells)
    return rows


def _heading(found: Sensitivity) -> str:
    numbers = zip(QUANTITIES.items(), found.values, strict=True)
    values = ", ".join(f"{name} {value:.5f} {unit}" for (name, unit), value in numbers)
    size = np.abs(found.relative).max(axis=1, keepdims=True)
    known = np.isfinite(found.errors).all(axis=0)
    agree = int((found.errors[:, known] <= _AGREES * size).all(axis=0).sum())
    return (
        f"{found.scene.name}, step {found.steps}: {values}. Of {len(found.parameters)} parameters "
        f"{agree} agree with differences to {_AGREES:g} of the largest number of each quantity; "
        f"{int((~known).sum())} without differences. Reasons against the derivative's existence: "
        f"{len(found.nonsmooth)}."
    )


def text(found: Sensitivity) -> str:
    """Lay the table out for a terminal."""
    rows = _rows(found)
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    lines = (
        "  ".join(
            cell.rjust(width) if i else cell.ljust(width)
            for i, (cell, width) in enumerate(zip(row, widths, strict=True))
        )
        for row in rows
    )
    heading = textwrap.fill(_heading(found), _WIDTH)
    return "\n\n".join([heading, _SCOPE, "\n".join(lines)])


def markdown(found: Sensitivity, command: str) -> str:
    """Lay the table out for a document."""
    head, *rows = ("| " + " | ".join(row) + " |" for row in _rows(found))
    table = "\n".join([head, "|---" * len(_rows(found)[0]) + "|", *rows])
    blocks = ["# Sensitivity of a gait", f"Written by `{command}`.", _heading(found), _SCOPE]
    return "\n\n".join([*blocks, "![Largest effects](sensitivity.png)", table]) + "\n"


def chart(found: Sensitivity) -> Figure:
    """Draw the largest effects, a panel for each quantity."""
    columns = ranked(found)[:_SHOWN]
    names = [list(found.parameters)[column] for column in columns]
    figure = Figure(figsize=(11.0, 0.3 * len(names) + 1.6), layout="constrained")
    panels = figure.subplots(1, len(QUANTITIES), sharey=True)
    for ax, name, numbers in zip(panels, QUANTITIES, found.relative, strict=True):
        shown = numbers[columns]
        colours = ["#0072B2" if x > 0.0 else "#D55E00" for x in shown]
        ax.barh(range(len(names)), shown, color=colours)
        ax.axvline(0.0, color="0.3", linewidth=0.8)
        ax.set_title(name)
        ax.grid(axis="x", color="0.92")
        ax.set_axisbelow(True)
        ax.tick_params(axis="y", length=0.0)
        ax.spines[["top", "right", "left"]].set_visible(False)
    panels[0].set_yticks(range(len(names)), names)
    panels[0].invert_yaxis()
    panels[1].set_xlabel("relative change per relative change of the parameter")
    figure.suptitle(f"{literal(found.scene.name)}, step {found.steps}: what the gait depends on")
    return figure


def write(found: Sensitivity, folder: Path, command: str) -> None:
    """Write sensitivity.md, sensitivity.json and sensitivity.png into a folder."""
    data = json.dumps(summary(found), allow_nan=False, indent=1)
    files.write_all(
        {
            folder / "sensitivity.png": files.png(chart(found), dpi=130),
            folder / "sensitivity.md": markdown(found, command).encode(),
            folder / "sensitivity.json": (data + "\n").encode(),
        }
    )
