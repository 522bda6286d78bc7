"""Replays of a scene: simulation, summary and figures."""

import textwrap
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from .._core import Simulator
from ..common import files, progress_bar
from ..scenes import SceneSource, as_scene, replace
from . import comparison, figures
from .recorder import ResidualPolicy, record
from .recording import Recording

TAU8: Mapping[str, Any] = {"control.arm_swing": {"amplitude": 30.0}}
_WITHOUT_TAU8: Mapping[str, Any] = {"control.arm_swing": None}
# Sample period of the detailed replay [s]; short states last a few milliseconds.
_DETAILED: Mapping[str, Any] = {"control.action_period": 1e-3}
# The step that Figs. 5 and 6 show; the first ones are not yet those of the cycle.
_SHOWN_STEP = 10


@dataclass(frozen=True)
class Start:
    """The scene's start, perturbed by ``sigma`` (see `Simulator.perturb`)."""

    sigma: float = 0.0
    seed: int = 0


def simulate(
    scene: SceneSource,
    steps: int,
    start: Start,
    label: str,
    policy: ResidualPolicy | None = None,
) -> Recording:
    """Record up to ``steps`` steps of a scene, with a progress bar on stderr."""
    sim = Simulator(as_scene(scene))
    if start.sigma != 0.0:
        sim.perturb(start.sigma, start.seed)
    with progress_bar(steps, label, "step") as bar:
        return record(sim, steps, progress=bar.update, policy=policy)


def summarise(recording: Recording) -> dict[str, Any]:
    """Return the statistics of a recording; lengths in m, times in s, None without a step."""
    steps = recording.steps
    step_time = float(steps["period"].sum())
    duration = float(recording.t[-1] - recording.t[0])
    wall_time = recording.metadata["wall_time"]
    return {
        "scene": recording.scene.name,
        "steps": int(steps.size),
        "slide_per_step": steps["slide"].tolist(),
        "loaded_slide_per_step": steps["loaded_slide"].tolist(),
        "period": steps["period"].tolist(),
        "lowest_head": float(np.min(steps["lowest_head"], initial=recording.head[:, 2].min())),
        "deepest_toe": float(steps["deepest_toe"].min()) if steps.size else None,
        "state_sequence": recording.state_sequence(),
        "inadmissible_fraction": float(steps["inadmissible_time"].sum()) / step_time
        if steps.size
        else None,
        "flight_fraction": float(np.mean(recording.state_number == 0)),
        "shoulder_correlation": figures.shoulder_correlation(recording),
        "duration": duration,
        "wall_time": wall_time,
        "real_time_factor": duration / wall_time if wall_time > 0.0 else None,
        "termination": recording.metadata["termination"],
        "accuracy": recording.scene.get("accuracy"),
        "stats": recording.metadata["stats"],
    }


def summary_text(summary: Mapping[str, Any]) -> str:
    """Format a summary; with a policy it also has the keys `policy` and `baseline`."""
    rows = []
    if "policy" in summary:
        rows.append(("policy", summary["policy"]))
        rows.append(("baseline's steps", _ending(summary["baseline"])))
    rows.append(("steps", _ending(summary)))
    if summary["steps"]:
        rows += [
            ("slide per step", _spread(summary["slide_per_step"], "m")),
            ("loaded slide", _spread(summary["loaded_slide_per_step"], "m")),
            ("period", _spread(summary["period"], "s")),
            ("states, last cycle", "-".join(map(str, summary["state_sequence"]))),
            ("inadmissible forces", f"{summary['inadmissible_fraction']:.1%} of the time"),
            ("lowest free toe", f"{1e3 * summary['deepest_toe']:.1f} mm (negative: below the ice)"),
        ]
    if summary["flight_fraction"]:
        rows.append(("both feet in the air", f"{summary['flight_fraction']:.1%} of the time"))
    rows.append(("lowest head", f"{summary['lowest_head']:.3f} m"))
    if summary["real_time_factor"] is not None:
        factor = f"{summary['real_time_factor']:.0f} times real time"
        engine = f"{summary['wall_time']:.3f} s for {summary['duration']:.2f} s, {factor}"
        rows.append(("engine", engine))
    accuracy = f"{summary['accuracy']}: {_counted(summary['stats'])}"
    indent = " " * 21
    wrapped = textwrap.fill(accuracy, 100, initial_indent=indent, subsequent_indent=indent)
    rows.append(("accuracy", wrapped.lstrip()))
    return "\n".join(f"{name:<20} {value}" for name, value in rows)


@files.own_style
def draw_comparison(recording: Recording, baseline: Recording, folder: Path) -> list[Path]:
    """Draw figures of a policy and of the baseline from the same start into a folder."""
    return _save(
        {
            "fig07_slide_distance": figures.slide_distance(recording),
            "fig08_step_period": figures.step_period(recording),
            "policy_and_baseline": comparison.policy_and_baseline(recording, baseline),
        },
        folder,
    )


@files.own_style
def draw(recording: Recording, steps: int, start: Start, folder: Path) -> list[Path]:
    """Draw Figs. 5 to 11 into a folder; return their paths.

    The figures need two more replays from the same start: a detailed one of the first steps, of
    which they show the last, and one with the arm swing's torque tau8 added or removed.
    """
    scene = recording.scene
    shown = min(steps, _SHOWN_STEP)
    detailed = simulate(replace(scene, _DETAILED), shown, start, "first steps")
    if recording.metadata["scene"] != replace(scene, _WITHOUT_TAU8).to_toml():
        with_tau8 = recording
        without = simulate(replace(scene, _WITHOUT_TAU8), steps, start, "without tau8")
    else:
        without = recording
        with_tau8 = simulate(replace(scene, TAU8), steps, start, "with tau8")
    both = (without, with_tau8)
    largest = max(float(np.abs(figures.shoulder_angles(each)).max()) for each in both)
    # The same axis for both, with space for a legend.
    limit = max(1.3 * largest, 1e-3)
    return _save(
        {
            "fig05_screenshots": figures.screenshots(detailed),
            "fig06_free_foot_height": figures.free_foot_height(detailed),
            "fig07_slide_distance": figures.slide_distance(recording),
            "fig08_step_period": figures.step_period(recording),
            "fig09_arms_without_tau8": figures.arm_angles(without, "Arms without tau8", limit),
            "fig10_arms_with_tau8": figures.arm_angles(with_tau8, "Arms with tau8", limit),
            "fig11_interference_torque": figures.interference_torque(with_tau8),
        },
        folder,
    )


def _save(drawn: Mapping[str, Figure], folder: Path) -> list[Path]:
    paths = []
    for name, figure in drawn.items():
        path = folder / f"{name}.png"
        files.write_figure(path, figure, 150)
        paths.append(path)
    return paths


def _ending(summary: Mapping[str, Any]) -> str:
    """Format the number of steps and the reason of the end."""
    if summary["termination"] is None:
        return f"{summary['steps']}, all steps made"
    return (
        f"{summary['steps']}, ended by {summary['termination']} after {summary['duration']:.2f} s"
    )


def _counted(stats: Mapping[str, float]) -> str:
    """Format the nonzero counts of the integrator."""
    units = {"error_estimate": " rad", "energy_residual": " J"}
    words = []
    for name, value in stats.items():
        if value:
            number = f"{value:.1e}" if name in units else f"{value:.0f}"
            words.append(f"{name.replace('_', ' ')} {number}{units.get(name, '')}")
    return ", ".join(words)


def _spread(values: list[float], unit: str) -> str:
    low, middle, high = np.min(values), np.median(values), np.max(values)
    return f"{middle:.3f} {unit} (median; {low:.3f} to {high:.3f})"
