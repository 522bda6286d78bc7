"""How costs grow: with environments, with threads, with degrees of freedom."""

import os
from collections.abc import Iterator

from .._core import Scene, Simulator
from ..effects import COMBINATIONS
from ..scenes import load_scene, replace
from .environments import vector
from .extent import Extent
from .states import PERIOD
from .table import OURS, Entry, Group, measure

ENVIRONMENTS, THREADS = "environments", "threads"
EVALUATION, STEP_OF = "one evaluation", "one step of `fast`"
SCENE = "paper"

_FACTOR = 4
_REPEATS = 100
# Motion before a simulator is measured [s].
_UNDER_WAY = 0.05


def cores() -> int:
    """Count the cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def more_environments(extent: Extent) -> Group:
    """Measure one step of batches of 1, 4, 16, ... environments."""
    entries, n = [], 1
    while n <= extent.most_environments:
        entries.append(vector(ENVIRONMENTS, f"{n}", SCENE, n, 1))
        n *= _FACTOR
    group = measure("Growth with environments", "one environment step", entries, extent.long_rounds)
    group.rates = True
    group.notes = [
        f"Scene {SCENE}, one thread, as above. A batch has a price of its own, which many "
        "environments share; where cost is linear in their number the time of one stays the same."
    ]
    return group


def more_threads(extent: Extent) -> Group:
    """Measure a batch with 1, 2, ... threads, up to the machine's cores."""
    entries = [
        vector(THREADS, f"{k}", SCENE, extent.environments, k) for k in range(1, cores() + 1)
    ]
    group = measure("Growth with threads", "one environment step", entries, extent.long_rounds)
    for row, threads in zip(group.rows, range(1, cores() + 1), strict=True):
        row.size = float(threads)
    group.rates = True
    group.notes = [
        f"Scene {SCENE}, {extent.environments} environments. Perfect scaling is a ratio of 1/2, "
        "1/3, ...; what else the machine does in the meantime counts against it."
    ]
    return group


def scaling(group: Group) -> dict[int, float]:
    """Divide the rate with n threads by n times the rate with one."""
    rows = group.of(THREADS)
    first = rows[0].time or 0.0
    return {int(row.size or 1): first / ((row.size or 1) * (row.time or 1)) for row in rows}


def more_freedom(extent: Extent) -> Group:
    """Measure evaluation and step with joints locked away."""
    entries = [entry for label, scene in _bodies() for entry in _freedom(label, scene)]
    entries.sort(key=lambda entry: entry.case)
    group = measure("Growth with degrees of freedom", "one", entries, extent.rounds)
    group.notes = [f"Scene {SCENE}, {1e3 * _UNDER_WAY:g} ms after its start, gliding on one foot."]
    return group


def _bodies() -> Iterator[tuple[str, Scene]]:
    scene = load_scene(SCENE)
    yield "as it is", scene
    yield "no head joint", scene.without("head_joint")
    yield "no trunk bending", scene.without("torso_pitch").without("torso_roll")
    yield "no arms", scene.without("arms")
    for label, effects in COMBINATIONS.items():
        left = scene
        for effect in effects:
            left = left.without(effect)
        yield label, left


def _freedom(label: str, scene: Scene) -> Iterator[Entry]:
    sim = Simulator(replace(scene, {"accuracy": "fast", "control.action_period": PERIOD}))
    sim.advance(_UNDER_WAY)
    n = len(sim.coordinate_names)
    for case, work in ((EVALUATION, "rhs"), (STEP_OF, "step")):

        def block(work: str = work) -> int:
            return round(1e9 * sim.measure(work, _REPEATS))

        what = f"Simulator.measure('{work}')"
        yield Entry(case, f"{n}: {label}", OURS, what, block, _REPEATS, size=float(n))
