"""How costs grow: with environments, with threads, with degrees of freedom."""

import os
from collections.abc import Iterator

from ..._core import Scene, Simulator
from ...scenes import load_scene, replace
from ..effects.study import COMBINATIONS
from .environments import vector
from .sizes import Extent
from .states import PERIOD
from .table import OURS, Entry, Group, measure

ENVIRONMENTS = "environments"
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
    """Measure batches of two sizes with 1, 2, ... threads, up to the machine's cores."""
    counts = range(1, cores() + 1)
    sizes = sorted({extent.environments, extent.most_environments})
    entries = [vector(threads_case(n), f"{k}", SCENE, n, k) for n in sizes for k in counts]
    group = measure("Growth with threads", "one environment step", entries, extent.long_rounds)
    for row, threads in zip(group.rows, [*counts] * len(sizes), strict=True):
        row.size = float(threads)
    group.rates = True
    group.notes = [
        f"Scene {SCENE}. Perfect scaling is a ratio of 1/2, 1/3, ...; what else the machine does "
        "in the meantime counts against it."
    ]
    return group


def threads_case(n: int) -> str:
    """Name the comparison of threads that share ``n`` environments."""
    return f"threads, {n} environments"


def scaling(group: Group, case: str) -> dict[int, float]:
    """Divide the rate with n threads by n times the rate with one."""
    rows = group.of(case)
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
