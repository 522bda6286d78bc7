"""The paper's figures, drawn from recordings."""

from collections.abc import Iterable

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle
from numpy.typing import NDArray

from .._core import Simulator
from ..common import literal
from .recording import Array, Recording

# Palette of Okabe and Ito, suitable for colour-blind readers.
_SUPPORT, _FREE, _TRUNK, _ARM = "#D55E00", "#0072B2", "#000000", "#8A8A8A"
_ICE = "#56B4E9"
# Rows of `Recording.segments`, the paper's link number minus one.
_SUPPORT_FOOT, _ANKLE_LINK, _FREE_SHANK, _FREE_FOOT, _HEAD = 0, 1, 5, 6, 16
_LIMBS = (
    (_ARM, (10, 11, 12, 13, 14, 15)),
    (_TRUNK, (3, 7, 8, 9)),
    (_FREE, (4, 5)),
    (_SUPPORT, (1, 2)),
)
# Screenshots in one row of Fig. 5.
_COLUMNS = 7
# The arms are shown over the last seconds of a run [s].
ARM_WINDOW = 8.0


def screenshots(recording: Recording) -> Figure:
    """Fig. 5: the robot at every change of state within the last step, seen from its right."""
    shots = _state_changes(recording)
    rows = -(-len(shots) // _COLUMNS)
    columns = min(max(len(shots), 3), _COLUMNS)
    figure = Figure(figsize=(1.6 + 1.55 * columns, 0.8 + 3.7 * rows), layout="constrained")
    axes = list(figure.subplots(rows, columns, sharey=True, squeeze=False).flat)
    half_width = 0.1 + 0.5 * max(np.ptp(recording.segments[i, :, :, 1]) for i in shots)
    for ax, i in zip(axes, shots, strict=False):
        draw_robot(ax, recording.segments[i])
        y = recording.segments[i, :, :, 1]
        middle = 0.5 * (y.min() + y.max())
        ax.set_xlim(middle - half_width, middle + half_width)
        ax.set_ylim(-0.12, 1.9)
        ax.set_aspect("equal")
        since = recording.t[i] - recording.t[shots[0]]
        ax.set_title(f"state {recording.state_number[i]}\n{since:.3f} s", fontsize=10)
        ax.set_xlabel("y [m]")
        ax.spines[["top", "right"]].set_visible(False)
    for ax in axes[len(shots) :]:
        ax.set_axis_off()
    figure.supylabel("z [m]")
    figure.suptitle("One step\nsupporting leg orange, free leg blue, arms grey", fontsize=11)
    return figure


def free_foot_height(recording: Recording) -> Figure:
    """Fig. 6: heel, toe and ankle of the free foot above the ice over the last step."""
    step = _last_step(recording)
    t = recording.t[step] - recording.t[step[0]]
    z = recording.segments[step, :, :, 2]
    figure, ax = _axes("time [s]", "height above the ice [m]", "Free foot over one step")
    ax.axhline(0.0, color=_ICE, linewidth=1.5)
    ax.plot(t, z[:, _FREE_SHANK, 1], color=_TRUNK, label="ankle (joint 7)")
    ax.plot(t, z[:, _FREE_FOOT, 0], color=_FREE, linestyle="--", label="heel")
    ax.plot(t, z[:, _FREE_FOOT, 1], color=_SUPPORT, linestyle="-.", label="toe")
    _span(ax, t[0], t[-1])
    states = recording.state_number[step]
    for i in np.flatnonzero(np.diff(states, prepend=states[0] - 1)):
        ax.axvline(t[i], color="0.85", linewidth=0.8, zorder=0)
    ax.legend()
    return figure


def slide_distance(recording: Recording) -> Figure:
    """Fig. 7: slide distance of the supporting foot in each step."""
    return _per_step(recording, "slide", "slide distance [m]", "Slide distance of each step")


def step_period(recording: Recording) -> Figure:
    """Fig. 8: period of each step."""
    return _per_step(recording, "period", "period [s]", "Duration of each step")


def arm_angles(recording: Recording, title: str, limit: float) -> Figure:
    """Figs. 9 and 10: both shoulders over the last seconds, on an axis of +-``limit`` rad."""
    shoulders = shoulder_angles(recording)
    end = recording.t[-1]
    correlation = shoulder_correlation(recording)
    suffix = "" if correlation is None else f", correlation {correlation:+.2f}"
    figure, ax = _axes("time [s]", "shoulder angle [rad]", title + suffix + _ending(recording))
    ax.plot(recording.t, shoulders[:, 0], color=_SUPPORT, label="right arm, $q_{11}$")
    ax.plot(recording.t, shoulders[:, 1], color=_FREE, linestyle="--", label="left arm, $q_{14}$")
    _span(ax, max(end - ARM_WINDOW, 0.0), end)
    ax.set_ylim(-limit, limit)
    ax.legend(loc="upper center", ncols=2)
    return figure


def interference_torque(recording: Recording) -> Figure:
    """Fig. 11: torque of the yaw acceleration on the right shoulder over the last seconds."""
    torque = yaw_on_shoulder(recording)
    end = recording.t[-1]
    title = "Interference torque of the yaw on the right shoulder"
    figure, ax = _axes("time [s]", r"$M_{11,8}\,\ddot q_8$ [N m]", title + _ending(recording))
    ax.plot(recording.t[recording.t >= end - ARM_WINDOW], torque, color=_TRUNK, linewidth=1.0)
    _span(ax, max(end - ARM_WINDOW, 0.0), end)
    return figure


def shoulder_angles(recording: Recording) -> Array:
    """Angles of the right and left shoulder (T, 2) [rad]; zero if the scene locks it."""
    columns = [recording.index(name) for name in ("q11", "q14")]
    zero = np.zeros_like(recording.t)
    return np.stack([zero if c is None else recording.q[:, c] for c in columns], axis=1)


def shoulder_correlation(recording: Recording) -> float | None:
    """Correlation of the two shoulder angles over the last seconds; None if one does not move."""
    shown = recording.t >= recording.t[-1] - ARM_WINDOW
    right, left = shoulder_angles(recording)[shown].T
    if min(np.ptp(right), np.ptp(left)) < 1e-9:
        return None
    return float(np.corrcoef(right, left)[0, 1])


def yaw_on_shoulder(recording: Recording) -> Array:
    """M_{11,8} q8'' of the samples in the last seconds [N m]; zero where either joint is locked."""
    shown = recording.t >= recording.t[-1] - ARM_WINDOW
    shoulder, yaw = recording.index("q11"), recording.index("q8")
    if shoulder is None or yaw is None:
        return np.zeros(np.count_nonzero(shown))
    sim = Simulator(recording.scene)
    torque: Array = recording.acceleration[shown, yaw]
    torque *= [sim.mass_matrix(q)[shoulder, yaw] for q in recording.q[shown]]
    return torque


def _axes(x_label: str, y_label: str, title: str) -> tuple[Figure, Axes]:
    figure = Figure(figsize=(7.0, 4.0), layout="constrained")
    ax = figure.subplots()
    ax.set(xlabel=x_label, ylabel=y_label, title=title)
    ax.grid(color="0.92")
    ax.spines[["top", "right"]].set_visible(False)
    return figure, ax


def _span(ax: Axes, first: float, last: float) -> None:
    """Let an axis of time begin and end with the motion, unless that has no duration."""
    if last > first:
        ax.set_xlim(first, last)


def _ending(recording: Recording) -> str:
    """Return a line for a title if the run ended before all its steps."""
    cause = recording.metadata["termination"]
    return "" if cause is None else f"\nended by {literal(cause)} at {recording.t[-1]:.2f} s"


def _per_step(recording: Recording, column: str, label: str, title: str) -> Figure:
    values = recording.steps[column]
    figure, ax = _axes("step", label, title + _ending(recording))
    ax.plot(np.arange(1, values.size + 1), values, color=_FREE, marker="o", markersize=3.0)
    # The axis starts at zero, so that the scatter is shown to scale.
    ax.set_ylim(min(0.0, 1.1 * values.min(initial=0.0)), 1.15 * values.max(initial=1e-3))
    ax.set_xlim(0, values.size + 1)
    return figure


def _last_step(recording: Recording) -> NDArray[np.int64]:
    """Select the samples of the last complete step, or all before the first swap of the legs."""
    swaps = recording.steps["time"][-2:]
    if swaps.size == 0:
        return np.arange(recording.t.size)
    begin = swaps[0] if swaps.size == 2 else -np.inf
    return np.flatnonzero((recording.t >= begin) & (recording.t < swaps[-1]))


def _state_changes(recording: Recording) -> list[int]:
    """Select the first sample of every state of the last step, and of the one after it."""
    step = _last_step(recording)
    first, last = int(step[0]), min(int(step[-1]) + 1, recording.t.size - 1)
    states = recording.state_number[first : last + 1]
    changes: Iterable[int] = (np.flatnonzero(np.diff(states)) + first + 1).tolist()
    return sorted({first, *changes, last})


def draw_robot(ax: Axes, segments: NDArray[np.float32]) -> None:
    """Draw links (17, 2, 3) [m] as a stick figure seen from the robot's right."""
    ax.axhline(0.0, color=_ICE, linewidth=1.5, zorder=0)
    for colour, links in _LIMBS:
        for link in links:
            ax.plot(*segments[link, :, 1:].T, color=colour, linewidth=2.0, solid_capstyle="round")
    feet = ((_FREE, _FREE_FOOT, _FREE_SHANK, 1), (_SUPPORT, _SUPPORT_FOOT, _ANKLE_LINK, 0))
    for colour, foot, shank, end in feet:
        corners = np.vstack([segments[foot, :, 1:], segments[shank, end, 1:]])
        ax.fill(*corners.T, color=colour, linewidth=1.0)
    neck, top = segments[_HEAD, :, 1:]
    head = Circle(tuple(0.5 * (neck + top)), 0.5 * float(np.linalg.norm(top - neck)))
    head.set(facecolor="white", edgecolor=_TRUNK, linewidth=2.0)
    ax.add_patch(head)
