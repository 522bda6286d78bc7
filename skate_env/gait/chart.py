"""A picture of a gait: contact states, heights of the feet and normal forces over one step."""

from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from ..common import literal
from ..replay import Array
from .contact import dwell, normal_forces
from .contact_sequence import StepOrder
from .motion import Motion

RGBA = tuple[float, float, float, float]
# Okabe and Ito's palette, which colour-blind readers can tell apart.
_COLOURS = {
    "supporting heel": "#D55E00",
    "supporting toe": "#E69F00",
    "free heel": "#0072B2",
    "free toe": "#56B4E9",
}
# Rows of `Recording.segments` of the ends of the soles: the foot's, and its end.
_SOLES = {
    "supporting heel": (0, 0),
    "supporting toe": (0, 1),
    "free heel": (6, 0),
    "free toe": (6, 1),
}
# Columns and rows of Table 2.
_SUPPORT = ("stuck flat", "stuck rotating", "sliding flat", "sliding rotating")
_FREE = ("in the air", "at a point, sliding", "at a point, stuck", "flat, sliding", "flat, stuck")
# A visit of a smaller share of the step is too narrow for its number.
_NARROW = 0.03


def one_step(name: str, motion: Motion) -> Figure:
    """Draw the last complete step of a motion that has one."""
    begin, end = motion.swaps[-2:]
    t = motion.recording.t
    within = (t >= begin) & (t < end)
    time = 1e3 * (t[within] - begin)
    figure = Figure(figsize=(9.0, 8.0), layout="constrained")
    strip, heights, forces = figure.subplots(3, 1, sharex=True, height_ratios=(0.8, 3.0, 3.0))
    _draw_states(strip, motion, motion.orders[-1])
    for sole, (foot, side) in _SOLES.items():
        z: Array = 1e3 * motion.recording.segments[within, foot, side, 2]
        heights.plot(time, z, color=_COLOURS[sole], label=sole)
    heights.axhline(0.0, color="0.4", linewidth=0.8)
    heights.set_ylabel("height above the ice [mm]")
    heights.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0))
    for sole, force in normal_forces(motion).items():
        forces.plot(time, force[within], color=_COLOURS[sole])
    forces.axhline(0.0, color="0.4", linewidth=0.8)
    forces.set(xlabel="time since the swap of the legs [ms]", ylabel="normal force [body weights]")
    forces.set_xlim(0.0, 1e3 * (end - begin))
    for ax in (heights, forces):
        ax.grid(color="0.92")
        ax.spines[["top", "right"]].set_visible(False)
    number = motion.recording.steps.size
    figure.suptitle(f"{literal(name)}, step {number}; negative force: the end is pulled down")
    return figure


def _draw_states(ax: Axes, motion: Motion, step: StepOrder) -> None:
    mean = dwell(motion)
    begin, period = 0.0, sum(time for _, time in step.visits)
    for state, time in step.merged():
        ax.barh(0.0, 1e3 * time, left=1e3 * begin, color=_colour(state), height=1.0)
        if time >= _NARROW * period:
            middle = 1e3 * (begin + 0.5 * time)
            ax.text(middle, 0.0, str(state), ha="center", va="center", fontsize=9)
        begin += time
    ax.set(ylim=(-0.6, 0.6), yticks=[])
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
