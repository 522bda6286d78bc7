"""Picture of an orbit: multipliers, phase portraits, decay; and its file beside the numbers."""

import json
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from skate_env.common import files, literal

from . import measure
from .close import Array
from .study import Study, summary

_BLUE, _ORANGE, _GREY = "#0072B2", "#D55E00", "0.6"
# Joints of the phase portraits.
_JOINTS = {"q3": "supporting knee", "q4": "supporting hip", "q6": "free knee", "q9": "trunk pitch"}
# Gait steps that are drawn of a longer cycle.
_DRAWN = 4


def draw(found: Study) -> Figure:
    """Draw the picture."""
    figure = Figure(figsize=(13.0, 8.0), layout="constrained")
    axes = figure.subplots(2, 3)
    _spectrum(axes[0, 0], found)
    _decay(axes[0, 1], found)
    names = found.orbit.strobe.sim.coordinate_names
    q, v, left = measure.path(found.orbit, 2 if found.orbit.start.steps == 1 else 1)
    shown = min(len(q), _DRAWN * found.orbit.start.samples // found.orbit.start.steps + 1)
    # The swap of the legs numbers the joints anew: no line leads over it.
    v[1:][left[1:] != left[:-1]] = np.nan
    for ax, (joint, what) in zip(axes.flat[2:], _JOINTS.items(), strict=True):
        at = names.index(joint)
        _portrait(ax, q[:shown, at], v[:shown, at], f"{joint}, {what}")
    figure.suptitle(_title(found))
    return figure


def _title(found: Study) -> str:
    start = found.orbit.start
    portraits = f"; portraits of the first {_DRAWN}" if start.steps > _DRAWN else ""
    return (
        f"{literal(found.orbit.strobe.scene.name)}: orbit of {start.steps} gait step(s), "
        f"{start.samples} samples of {1e3 * start.period:.6g} ms{portraits}"
    )


def _spectrum(ax: Axes, found: Study) -> None:
    angle = np.linspace(0.0, 2.0 * np.pi, 400)
    ax.plot(np.cos(angle), np.sin(angle), color=_GREY, linewidth=1.0)
    inside = np.abs(found.multipliers) < 1.0
    for which, colour in ((inside, _BLUE), (~inside, _ORANGE)):
        some = found.multipliers[which]
        ax.plot(some.real, some.imag, "o", color=colour, markersize=5)
    ax.set_aspect("equal")
    ax.set_xlabel("real part")
    ax.set_ylabel("imaginary part")
    outside = int((~inside).sum())
    ax.set_title(f"Multipliers: {int(inside.sum())} inside, {outside} outside")
    _tidy(ax)


def _decay(ax: Axes, found: Study) -> None:
    steps = np.arange(len(found.decay.measured))
    ax.semilogy(steps, found.decay.predicted, color=_GREY, linewidth=3.0, label="predicted")
    ax.semilogy(steps, found.decay.measured, "o", color=_BLUE, label="measured")
    ax.set_xlabel("gait steps")
    ax.set_ylabel("deviation [rad, rad/s, m, m/s]")
    ax.set_title("Decay of a deviation")
    ax.legend(fontsize="small")
    _tidy(ax)


def _portrait(ax: Axes, angle: Array, rate: Array, title: str) -> None:
    ax.plot(angle, rate, color=_BLUE, linewidth=1.2)
    ax.plot(angle[0], rate[0], "o", color=_ORANGE, label="first sample after the swap")
    ax.set_xlabel("angle [rad]")
    ax.set_ylabel("rate [rad/s]")
    ax.set_title(title)
    ax.legend(fontsize="small")
    _tidy(ax)


def _tidy(ax: Axes) -> None:
    ax.grid(color="0.92")
    ax.set_axisbelow(True)
    ax.spines[["top", "right"]].set_visible(False)


def write(found: Study, folder: Path) -> None:
    """Write orbit.json and orbit.png into a folder."""
    data = json.dumps(summary(found), allow_nan=False, indent=1)
    files.write_all(
        {
            folder / "orbit.png": files.png(draw(found), dpi=130),
            folder / "orbit.json": (data + "\n").encode(),
        }
    )
