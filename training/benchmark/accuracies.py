"""The picture of what the accuracy of a training matters for: all policies under `reference`."""

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure

from .tables import Results

NAMES = {"example_fast": "fast, 5 ms", "example": "fast, 1 ms", "example_balanced": "balanced"}
"""Learners that differ in the accuracy of their training."""
ID = "IceSkatePushOnly-v0"
RUNS = tuple((ID, name) for name in NAMES)
# Statistics of the evaluation, with their factor and label.
SHOWN = {
    "goal": (100.0 / 256, "starts with 20 steps in 10 s [%]"),
    "slide": (1.0, "slide per step [m]"),
    "return": (1.0, "return in 30 s"),
}


def draw(found: Results) -> Figure:
    """Draw a panel for each statistic: a dot for each seed, by the accuracy of its training."""
    figure, axes = plt.subplots(1, len(SHOWN), figsize=(10.0, 3.6), layout="constrained")
    for ax, (key, (factor, label)) in zip(axes, SHOWN.items(), strict=True):
        for place, name in enumerate(NAMES):
            values = [factor * run["reference"][key] for run in found[ID, name]]
            spread = place + np.linspace(-0.15, 0.15, len(values))
            ax.plot(spread, values, "o", color=f"C{place}", ms=5)
            ax.plot([place - 0.25, place + 0.25], [np.median(values)] * 2, color=f"C{place}")
        labels = []
        for name in NAMES:
            minutes = np.median([run["minutes"][-1] for run in found[ID, name]])
            labels.append(f"{NAMES[name]}\n{minutes:.1f} min")
        ax.set_xticks(range(len(labels)), labels, fontsize=8)
        ax.set_ylabel(label)
        ax.set_ylim(bottom=0.0)
        ax.grid(axis="y", alpha=0.3)
    figure.suptitle(
        f"{ID}: policies by the accuracy of their training, played under reference", fontsize=10
    )
    return figure
