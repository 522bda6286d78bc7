"""A picture of a card: contact states, heights of the feet and normal forces over one step."""

from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from ..common import literal
from .card import Card
from .contact import dwell, normal_forces
from .contact_sequence import SHORTEST_VISIT, StepOrder
from .motion import Motion

RGBA = tuple[float, float, float, float]
# Okabe and Ito's palette, which colour-blind readers can tell apart.
_COLOURS = {
    "supporting heel": "#D55E00",
    "supporting toe": "#E69F00",
    "free heel": "#0072B2",
    "free toe": "#56B4E9",
}
# Heights of the ends of the soles in an observation [m].
_HEIGHTS = {
    "supporting heel": "height.support_heel",
    "supporting toe": "height.support_toe",
    "free heel": "height.free_heel",
    "free toe": "height.free_toe",
}
# Columns and rows of Table 2.
_SUPPORT = ("stuck flat", "stuck rotating", "sliding flat", "sliding rotating")
_FREE = ("in the air", "at a point, sliding", "at a point, stuck", "flat, sliding", "flat, stuck")
# A visit of a smaller share of the step has its number above the strip, if there is room.
_NARROW = 0.03
# Limit on the pull of an end in the paper's gait [body weights].
_PULL = 3.0


def one_step(card: Card) -> Figure:
    """Draw the last complete step of a motion that has one."""
    motion = card.motion
    begin, end = motion.swaps[-2:]
    t = motion.samples.t
    within = (t >= begin) & (t < end)
    time = 1e3 * (t[within] - begin)
    figure = Figure(figsize=(9.0, 8.0), layout="constrained")
    strip, heights, forces = figure.subplots(3, 1, sharex=True, height_ratios=(0.8, 3.0, 3.0))
    _draw_states(strip, motion, motion.orders[-1])
    for name, entry in _HEIGHTS.items():
        z = 1e3 * motion.observed(entry)[within, 0]
        heights.plot(time, z, color=_COLOURS[name], label=name)
    heights.axhline(0.0, color="0.4", linewidth=0.8)
    heights.set_ylabel("height above the ice [mm]")
    heights.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0))
    for name, force in normal_forces(motion).items():
        forces.plot(time, force[within], color=_COLOURS[name])
    forces.axhline(0.0, color="0.4", linewidth=0.8)
    limit = forces.axhline(-_PULL, color="black", linestyle="--", linewidth=0.8)
    forces.set(xlabel="time since the swap of the legs [ms]", ylabel="normal force [body weights]")
    forces.legend([limit], ["largest pull\nallowed"], loc="upper left", bbox_to_anchor=(1.0, 1.0))
    forces.set_xlim(0.0, 1e3 * (end - begin))
    for ax in (heights, forces):
        ax.grid(color="0.92")
        ax.spines[["top", "right"]].set_visible(False)
    number = motion.recording.steps.size
    figure.suptitle(f"{literal(card.name)}, step {number}; negative force: the end is pulled down")
    return figure


def _draw_states(ax: Axes, motion: Motion, step: StepOrder) -> None:
    mean = dwell(motion)
    begin, period = 0.0, sum(time for _, time in step.visits)
    # Place of the last number in each of two rows above the strip, as a share of the step.
    taken = [-1.0, -1.0]
    for state, time in step.merged():
        ax.barh(0.0, 1e3 * time, left=1e3 * begin, color=_colour(state), height=1.0)
        middle = (begin + 0.5 * time) / period
        begin += time
        if time >= _NARROW * period:
            height = 0.0
        elif time >= SHORTEST_VISIT and min(taken) < middle - _NARROW:
            row = int(taken[0] >= middle - _NARROW)
            height, taken[row] = 0.75 + 0.35 * row, middle
        else:
            continue
        ax.text(1e3 * middle * period, height, str(state), ha="center", va="center", fontsize=9)
    ax.set(ylim=(-0.6, 1.4), yticks=[])
    ax.set_ylabel("state", rotation=0, ha="right", va="center")
    ax.spines[["top", "right", "left"]].set_visible(False)
    handles = [
        Patch(color=_colour(int(state)), label=f"{_meaning(int(state))}; mean {time:.3g} ms")
        for state, time in mean.items()
    ]
    ax.legend(handles=handles, loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2, fontsize=8)


def _colour(state: int) -> RGBA:
    """Hue of the free foot's contact, shade of the supporting foot's."""
    return colormaps["tab20c"](state - 1) if state else (0.95, 0.95, 0.95, 1.0)


def _meaning(state: int) -> str:
    """Row of Table 2 in words."""
    if state == 0:
        return "0: both feet in the air"
    free, support = divmod(state - 1, len(_SUPPORT))
    return f"{state}: support {_SUPPORT[support]}, free foot {_FREE[free]}"
