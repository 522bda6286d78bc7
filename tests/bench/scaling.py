"""Scaling of costs with environments, threads and degrees of freedom."""

import os
from collections.abc import Iterator

from skate_env._core import Scene, Simulator
from skate_env.scenes import load_scene, replace
from skate_env.studies import timing
from skate_env.studies.effects.study import COMBINATIONS

from .environments import vector
from .sizes import Sizes
from .states import PERIOD
from .table import OURS, Entry, Group, measure

ENVIRONMENTS = "environments"
EVALUATION, STEP_OF = "one evaluation", "one step of `fast`"
SCENE = "paper"

_FACTOR = 4
_REPEATS = 100
# Simulated time before a simulator is measured [s].
_START_TIME = 0.05


def cores() -> int:
    """Return the number of cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def more_environments(sizes: Sizes) -> Group:
    """Measure one step of batches of 1, 4, 16, ... environments."""
    entries, n = [], 1
    while n <= sizes.most_environments:
        entries.append(vector(ENVIRONMENTS, f"{n}", SCENE, n, 1))
        n *= _FACTOR
    group = measure("Scaling with environments", "one environment step", entries, sizes.long_rounds)
    group.rates = True
    group.notes = [
        f"Scene {SCENE}, one thread, as above. The fixed cost of a batch is divided among its "
        "environments; beyond it the time per environment is constant if the cost is linear."
    ]
    return group


def more_threads(sizes: Sizes) -> Group:
    """Measure batches of two sizes with 1, 2, ... threads, up to the machine's cores."""
    counts = range(1, cores() + 1)
    batches = sorted({sizes.environments, sizes.most_environments})
    entries = [vector(threads_case(n), f"{k}", SCENE, n, k) for n in batches for k in counts]
    group = measure("Scaling with threads", "one environment step", entries, sizes.long_rounds)
    for row, threads in zip(group.rows, [*counts] * len(batches), strict=True):
        row.size = float(threads)
    group.rates = True
    group.notes = [
        f"Scene {SCENE}. Ideal scaling is a ratio of 1/2, 1/3, ...; load of other processes "
        "increases the ratios."
    ]
    return group


def threads_case(n: int) -> str:
    """Return the name of the comparison of threads for ``n`` environments."""
    return f"threads, {n} environments"


def scaling(group: Group, case: str) -> dict[int, float]:
    """Return the parallel efficiency by number of threads: rate / (threads * rate of one)."""
    rows = group.of(case)
    first = rows[0].time or 0.0
    return {int(row.size or 1): first / ((row.size or 1) * (row.time or 1)) for row in rows}


def more_freedom(sizes: Sizes) -> Group:
    """Measure an evaluation and a step with locked joints."""
    entries = [entry for label, scene in _bodies() for entry in _freedom(label, scene)]
    entries.sort(key=lambda entry: entry.case)
    group = measure("Scaling with degrees of freedom", "one", entries, sizes.rounds)
    group.notes = [f"Scene {SCENE}, {1e3 * _START_TIME:g} ms after its start, gliding on one foot."]
    return group


def _bodies() -> Iterator[tuple[str, Scene]]:
    scene = load_scene(SCENE)
    yield "all joints", scene
    yield "no head joint", scene.without("head_joint")
    yield "no trunk bending", scene.without("trunk_pitch").without("trunk_roll")
    yield "no arms", scene.without("arms")
    for label, effects in COMBINATIONS.items():
        left = scene
        for effect in effects:
            left = left.without(effect)
        yield label, left


def _freedom(label: str, scene: Scene) -> Iterator[Entry]:
    sim = Simulator(replace(scene, {"accuracy": "fast", "control.action_period": PERIOD}))
    sim.advance(_START_TIME)
    n = len(sim.coordinate_names)
    for case, work in ((EVALUATION, "rhs"), (STEP_OF, "step")):
        block = timing.inside([sim], work, _REPEATS)
        what = f"Simulator.measure('{work}')"
        yield Entry(case, f"{n}: {label}", OURS, what, block, _REPEATS, size=float(n))
