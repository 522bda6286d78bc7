"""Figure that compares a policy with the baseline from the same start."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure, SubFigure
from matplotlib.patches import Patch

from ..common import literal
from .recording import Array, Recording

# Colours of the supporting leg.
_RIGHT, _LEFT = "#CC79A7", "#009E73"
# Colour and width of curves; the thinner one is drawn on top.
_LINES = {"baseline": ("0.72", 3.5), "policy": ("0.0", 1.3)}
# Time before and after the earlier end for which contact states are shown [s].
_BEFORE, _AFTER = 8.0, 4.0
# Row of `Recording.segments` between the hips.
_WAIST = 3


def policy_and_baseline(policy: Recording, baseline: Recording) -> Figure:
    """Draw contact states about the earlier end, hip displacement and head height of both."""
    both = {"baseline": baseline, "policy": policy}
    ends = [recording.t[-1] for recording in both.values()]
    begin, end = max(min(ends) - _BEFORE, policy.t[0]), min(min(ends) + _AFTER, max(ends))
    figure = Figure(figsize=(13.0, 8.0), layout="constrained")
    name = literal(policy.scene.name)
    figure.suptitle(f"Policy and baseline from the same start, scene {name}")
    grid = figure.add_gridspec(2, 1)
    states, curves = (figure.add_subfigure(grid[i]) for i in range(2))
    rows = states.subplots(2, 1, sharex=True)
    for ax, (name, recording) in zip(rows, both.items(), strict=True):
        ax.set_xlim(begin, end)
        _draw_states(ax, name, recording)
    rows[1].set_xlabel("time [s]")
    legs = {"right leg supports": _RIGHT, "left leg supports": _LEFT}
    handles = [Patch(color=colour, label=leg) for leg, colour in legs.items()]
    rows[0].legend(handles=handles, loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2)
    way, head = _draw_curves(curves, both)
    for ax in (way, head):
        ax.axvspan(begin, end, color="#56B4E9", alpha=0.12, zorder=0, label="shown above")
    way.legend(loc="upper left")
    return figure


def _draw_states(ax: Axes, name: str, recording: Recording) -> None:
    # From the events, because many states are shorter than the time between samples.
    events = recording.events
    t = np.concatenate([recording.t[:1], events["time"], recording.t[-1:]])
    states = np.concatenate([recording.state_number[:1], events["after"]])
    right = np.concatenate([recording.right_support[:1], events["support_leg"] == "right"])
    runs = [[(t[i], state), (t[i + 1], state)] for i, state in enumerate(states)]
    ax.step(t[:-1], states, where="post", color="0.75", linewidth=0.6)
    colours = np.where(right, _RIGHT, _LEFT).tolist()
    ax.add_collection(LineCollection(runs, colors=colours, linewidths=4.0, capstyle="butt"))
    # Ticks at groups of rows of Table 2 (contact of the free foot); 0 is flight.
    ax.set(ylim=(-1.0, 21.0), yticks=[0, 5, 9, 13, 17, 20], ylabel=f"{name}\ncontact state")
    ax.spines[["top", "right"]].set_visible(False)
    ax.grid(color="0.92", axis="y")
    if recording.metadata["termination"] is not None:
        ax.axvspan(t[-1], t[-1] + _AFTER, color="0.93", zorder=0)
        # On the side with more space.
        side = "right" if t[-1] > np.mean(ax.get_xlim()) else "left"
        ax.text(t[-1], 20.0, f"  {_ending(recording)}  ", va="top", ha=side, clip_on=True)


def _draw_curves(figure: SubFigure, both: dict[str, Recording]) -> tuple[Axes, Axes]:
    way, head = figure.subplots(2, 1, sharex=True)
    for name, recording in both.items():
        colour, width = _LINES[name]
        hips: Array = recording.segments[:, _WAIST, :, 1].mean(axis=1, dtype=np.float64)
        label = f"{name}, {_ending(recording)}"
        for ax, y in ((way, hips - hips[0]), (head, recording.head[:, 2])):
            ax.plot(recording.t, y, color=colour, linewidth=width, label=label)
            if recording.metadata["termination"] is not None:
                ax.axvline(recording.t[-1], color=colour, linestyle=":")
                ax.plot(recording.t[-1], y[-1], "X", color=colour, markersize=10.0)
    way.set_ylabel("hip displacement [m]")
    head.set(xlabel="time [s]", ylabel="top of the head [m]", ylim=(0.0, 2.2))
    for ax in (way, head):
        ax.margins(x=0.01)
        ax.grid(color="0.92")
        ax.spines[["top", "right"]].set_visible(False)
    return way, head


def _ending(recording: Recording) -> str:
    cause = recording.metadata["termination"]
    why = f"{len(recording.steps)} steps" if cause is None else literal(cause)
    return f"{why} at {recording.t[-1]:.2f} s"
