"""Long simulations of many gait steps, compared by statistics instead of trajectories.

The statistics are the mean slide and period of the gait steps, and the number of steps made.
"""

import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..._core import Simulator
from ...common import progress_bar
from ...scenes import load_scene, replace
from .settings import Setting

SCENE = "paper_printed"
_LONGEST = 2.0
"""Time limit per gait step [simulated s]."""


@dataclass(frozen=True)
class Walk:
    """Statistics of a setting; None where it made no gait step."""

    method: str
    label: str
    value: float | None
    steps: int
    wanted: int
    termination: str | None
    simulated_time: float
    """[s]"""
    slide: float | None
    """Mean over the gait steps [m]."""
    slide_deviation: float | None
    """Standard deviation over the gait steps [m]."""
    period: float | None
    """Mean over the gait steps [s]."""
    period_deviation: float | None
    """[s]"""
    time: float
    """Wall time per simulated second, measured once [s]."""
    evaluations: float
    """Evaluations of the dynamics per simulated second."""


def walk(chosen: Sequence[Setting], steps: int) -> list[Walk]:
    """Simulate with every setting, with a progress bar on stderr."""
    scene = load_scene(SCENE)
    walks = []
    with progress_bar(len(chosen), f"{steps} steps", "setting") as bar:
        for setting in chosen:
            sim = Simulator(replace(scene, {"accuracy": setting.accuracy}))
            walks.append(_walk(sim, setting, steps))
            bar.update()
    return walks


def _walk(sim: Simulator, setting: Setting, steps: int) -> Walk:
    made: list[dict[str, float]] = []
    before = time.perf_counter()
    going = True
    while going and len(made) < steps and sim.time < _LONGEST * steps:
        going = sim.step()
        made += sim.take_steps()
    wall = time.perf_counter() - before
    slides = [step["slide"] for step in made[:steps]]
    periods = [step["period"] for step in made[:steps]]
    simulated = max(sim.time, sim.action_period)
    return Walk(
        method=setting.method,
        label=setting.label,
        value=setting.value,
        steps=len(slides),
        wanted=steps,
        termination=sim.termination,
        simulated_time=sim.time,
        slide=_mean(slides),
        slide_deviation=_deviation(slides),
        period=_mean(periods),
        period_deviation=_deviation(periods),
        time=wall / simulated,
        evaluations=sim.stats()["evaluations"] / simulated,
    )


def _mean(values: list[float]) -> float | None:
    return float(np.mean(values)) if values else None


def _deviation(values: list[float]) -> float | None:
    return float(np.std(values)) if values else None
