"""Colours of charts, and the frame of their axes."""

from typing import Literal

from matplotlib.axes import Axes

# Palette of Okabe and Ito, suitable for colour-blind readers.
BLUE, SKY, GREEN = "#0072B2", "#56B4E9", "#009E73"
ORANGE, VERMILION, PURPLE = "#E69F00", "#D55E00", "#CC79A7"
BLACK, GREY = "#000000", "#999999"

METHODS = {"dop853": BLUE, "dopri5": SKY, "rk4": GREEN, "rosenbrock": PURPLE, "moreau": ORANGE}
"""Colours of the engine's integration methods."""


def frame(ax: Axes, grid: Literal["both", "x", "y"] = "both") -> None:
    """Draw a light grid behind the data, and no lines at the top and on the right."""
    ax.grid(axis=grid, which="major", color="0.92")
    ax.set_axisbelow(True)
    ax.spines[["top", "right"]].set_visible(False)
