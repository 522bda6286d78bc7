"""Cost of each effect of a scene, and the change of the motion.

The scene is compared with copies in which one effect is added or removed. All runs start from the
scene's start and have the same simulated time, in one call of `Simulator.step`.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..._core import Scene, Simulator
from ...common import progress_bar
from ...scenes import as_scene
from .. import timing
from ..callgrind import Unavailable, instructions_per_evaluation
from ..report import installed_version

Array = NDArray[np.float64]

_BODY = ("arms", "head_joint", "trunk_yaw", "trunk_pitch", "trunk_roll")
COMBINATIONS: dict[str, tuple[str, ...]] = {
    "no arms, no head joint": _BODY[:2],
    "also no trunk bending": (*_BODY[:2], "trunk_pitch", "trunk_roll"),
    "legs only": _BODY,
}
"""Effects that are removed together."""

ROUNDS, QUICK_ROUNDS = 200, 10

# A run lasts 1 s (the longest action period), or 1/2, 1/4, ... of it [s], so that the unchanged
# scene does not end and needs at most `_EVALUATIONS`.
_LONGEST, _SHORTEST = 1.0, 0.01
_EVALUATIONS = 10_000
# A variant that chatters is timed over a part of its run, with at most this multiple of the
# evaluations of the unchanged scene.
_CHATTER = 4
_SAMPLES = 100
# Row of the waist in `Simulator.link_segments`.
_WAIST = 3


@dataclass
class Row:
    """Results of the scene with one change; None where not measured.

    Ratios are relative to the unchanged scene.
    """

    label: str
    kind: str
    """`unchanged`, `removed`, `combination` or `added`."""
    reason: str | None = None
    """Why there are no results."""
    dof: int | None = None
    rows: int | None = None
    guards: int | None = None
    simulated_time: float | None = None
    """Simulated time [s]; shorter if there is a `termination`."""
    termination: str | None = None
    evaluations: int | None = None
    """Evaluations of the right-hand side in that time."""
    evaluations_per_second: float | None = None
    """Per second of simulated time, like all rates below [1/s]."""
    timed_over: float | None = None
    """Simulated time of the blocks for times and instructions [s]."""
    instructions_per_evaluation: float | None = None
    instructions_per_second: float | None = None
    instruction_ratio_per_evaluation: float | None = None
    instruction_ratio_per_second: float | None = None
    time_per_evaluation: float | None = None
    """Least time of all rounds [s]."""
    time_ratio_per_evaluation: float | None = None
    time_ratio_per_second: float | None = None
    mujoco_ratio: float | None = None
    head_change: float | None = None
    """Largest distance between the heads of both runs [m]."""
    hips_change: float | None = None
    """Change of the hips' displacement while both runs last [m]."""


@dataclass
class Comparison:
    """A scene's table."""

    scene: str
    simulated_time: float
    """Simulated time of runs that do not end early [s]."""
    hips_progress: float
    """Displacement of the hips in the unchanged scene in that time [m]."""
    rounds: int
    rows: list[Row]
    time_error: float = 0.0
    """Largest relative difference of a time ratio between both halves of the rounds."""
    mujoco_error: float | None = None
    mujoco_version: str | None = None
    notes: dict[str, str] = field(default_factory=dict)
    """Reasons for empty columns."""


@dataclass
class _Run:
    """A row with its scene and simulator."""

    row: Row
    scene: Scene
    block: Simulator
    """Simulator whose action period is the timed block."""
    block_evaluations: int


def compare(scene: Scene | str | Path, rounds: int = ROUNDS) -> Comparison:
    """Measure a scene and its variants, with progress bars on stderr.

    Raises
    ------
    ValueError
        If the scene has no start or ends at once.
    """
    scene = as_scene(scene)
    unchanged, period = _unchanged(scene)
    rows, runs = [unchanged.row], [unchanged]
    head, hips = _motion(scene, period)
    table = Comparison(scene.name, period, float(hips[-1]), rounds, rows)
    with progress_bar(len(scene.effects()) + len(COMBINATIONS), "simulate", "variant") as bar:
        for row, variant in _variants(scene):
            rows.append(row)
            if variant is not None:
                run = _run(row, variant, period, _CHATTER * unchanged.block_evaluations)
                if run is not None:
                    runs.append(run)
                    other_head, other_hips = _motion(variant, period)
                    n = min(len(head), len(other_head))
                    row.head_change = _distance(head[:n], other_head[:n])
                    row.hips_change = float(other_hips[n - 1] - hips[n - 1])
            bar.update()
    _count_instructions(runs, table)
    _time(runs, table)
    return table


def _variants(scene: Scene) -> Iterator[tuple[Row, Scene | None]]:
    """Yield the variants; the scene is None if the rest of the scene contradicts the change."""
    on = scene.effects()
    changes: list[tuple[str, str, tuple[str, ...]]]
    changes = [(f"without {name}", "removed", (name,)) for name in on if on[name]]
    changes += [(label, "combination", names) for label, names in COMBINATIONS.items()]
    changes += [(f"with {name}", "added", (name,)) for name in on if not on[name]]
    for label, kind, names in changes:
        row, variant = Row(label, kind), scene
        try:
            for name in names:
                variant = variant.with_effect(name) if kind == "added" else variant.without(name)
            Simulator(variant)
        except ValueError as error:
            row.reason = str(error)
            yield row, None
        else:
            yield row, variant


def _lasting(scene: Scene, period: float) -> Simulator:
    return Simulator(scene.with_values({"control.action_period": period}))


def _unchanged(scene: Scene) -> tuple[_Run, float]:
    """Run the unchanged scene and find the simulated time of all runs [s]."""
    period = _LONGEST
    while period >= _SHORTEST:
        sim = _lasting(scene, period)
        if sim.step() and sim.stats()["evaluations"] <= _EVALUATIONS:
            row = Row("unchanged", "unchanged", head_change=0.0, hips_change=0.0)
            run = _run(row, scene, period, _EVALUATIONS)
            assert run is not None
            return run, period
        period /= 2
    raise ValueError(
        f"scene {scene.name}: it reaches {sim.time:.3g} s ({sim.termination or 'too slow'}) of "
        f"the {_SHORTEST} s that a comparison needs"
    )


def _run(row: Row, scene: Scene, period: float, most: int) -> _Run | None:
    """Simulate the whole run and fill in its counts; None if it ends at once."""
    sim = _lasting(scene, period)
    sim.step()
    size = sim.size()
    row.dof, row.rows, row.guards = size["dof"], size["rows"], size["guards"]
    row.simulated_time, row.termination = sim.time, sim.termination
    row.evaluations = evaluations = int(sim.stats()["evaluations"])
    if row.simulated_time < 0.01 * period:
        row.reason = f"ends with {row.termination} after {row.simulated_time:.4f} s"
        return None
    row.evaluations_per_second = evaluations / row.simulated_time
    while evaluations > most and period > _SHORTEST:
        period /= 2
        sim = _lasting(scene, period)
        sim.step()
        evaluations = int(sim.stats()["evaluations"])
    row.timed_over = sim.time
    return _Run(row, sim.scene, sim, evaluations)


def _motion(scene: Scene, period: float) -> tuple[Array, Array]:
    """Sample a run: position of the head (T, 3), displacement of the hips (T,) [m]."""
    sim = _lasting(scene, period / _SAMPLES)
    head, hips = [sim.head_position], [sim.link_segments()[_WAIST, :, 1].mean()]
    for _ in range(_SAMPLES):
        if not sim.step():
            break
        head.append(sim.head_position)
        hips.append(sim.link_segments()[_WAIST, :, 1].mean())
    return np.array(head), np.array(hips) - hips[0]


def _distance(a: Array, b: Array) -> float:
    return float(np.linalg.norm(a - b, axis=1).max())


def _count_instructions(runs: Sequence[_Run], table: Comparison) -> None:
    with progress_bar(len(runs), "callgrind", "variant") as bar:
        try:
            counts = instructions_per_evaluation([run.scene for run in runs], bar.update)
        except Unavailable as error:
            table.notes["instructions"] = str(error)
            return
    for run, count in zip(runs, counts, strict=True):
        row = run.row
        assert row.evaluations_per_second is not None
        row.instructions_per_evaluation = count
        row.instructions_per_second = count * row.evaluations_per_second
        row.instruction_ratio_per_evaluation = ratio = count / counts[0]
        row.instruction_ratio_per_second = ratio * _frequency(row, runs[0].row)


def _time(runs: Sequence[_Run], table: Comparison) -> None:
    """Time all variants alternately, and those with another body in MuJoCo as well."""
    blocks = [timing.timed(run.block.step, run.block.reset) for run in runs]
    labels = {f"{how} {name}" for name in _BODY for how in ("with", "without")}
    labels |= {"unchanged", *COMBINATIONS}
    bodies = [run for run in runs if run.row.label in labels]
    try:
        blocks += [timing.mujoco(run.scene) for run in bodies]
        table.mujoco_version = installed_version("mujoco")
    except ImportError:
        table.notes["mujoco"] = "mujoco is not installed"
    with progress_bar(table.rounds, "time", "round") as bar:
        times = timing.interleaved(blocks, table.rounds, bar.update)
    ours, theirs = times[: len(runs)], times[len(runs) :]
    counts = np.array([run.block_evaluations for run in runs])
    each, ratios, table.time_error = timing.ratios(ours / counts[:, None])
    for run, least, ratio in zip(runs, each, ratios, strict=True):
        row = run.row
        row.time_per_evaluation = least
        row.time_ratio_per_evaluation = ratio
        row.time_ratio_per_second = ratio * _frequency(row, runs[0].row)
    if len(theirs):
        _, ratios, table.mujoco_error = timing.ratios(theirs)
        for run, ratio in zip(bodies, ratios, strict=True):
            run.row.mujoco_ratio = ratio


def _frequency(row: Row, first: Row) -> float:
    """Return evaluations per simulated second, relative to the unchanged scene."""
    assert row.evaluations_per_second is not None and first.evaluations_per_second is not None
    return row.evaluations_per_second / first.evaluations_per_second
