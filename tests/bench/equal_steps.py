"""Cost and error of environment steps of IceSkate and of the same body in MuJoCo."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from skate_env._core import Simulator
from skate_env.common import progress_bar
from skate_env.environments import IceSkateVectorEnv
from skate_env.scenes import load_scene
from skate_env.studies.fixtures import name_of
from skate_env.studies.fronts import Point, cost_at
from skate_env.studies.report import significant

from .environments import (
    EPISODE,
    LOCATED,
    MOREAU,
    MUJOCO_ENV,
    PERTURB,
    SCENES,
    episode,
    new,
    vector,
)
from .mujoco_env import MujocoSkateEnv
from .peers import tool
from .sizes import Sizes
from .states import PERIOD, STEP
from .table import OURS, Entry, Error, Group, Row, attempted, measure

Array = NDArray[np.float64]
Progress = Callable[[], object]

# Actions before motions are compared, number of starts, environments of a batch.
_ACTIONS, _STARTS, _BATCH = 10, 64, 256
_ACCURACIES = ("fast", "balanced", *MOREAU, *LOCATED)
# MuJoCo's integrators and timesteps [s]; RK4 is unstable at longer ones.
_SETTINGS = (
    *(("Euler", step) for step in (5e-3, STEP, 1.25e-3, 6.25e-4, 3.125e-4, 1.5625e-4, 5e-5)),
    *(("RK4", step) for step in (1.25e-3, 6.25e-4, 3.125e-4)),
)
# Settings of the limits that errors are relative to.
_OUR_LIMIT, _LIMIT = "reference", ("RK4", 1e-5)

ANGLES = 2
"""Index of the first angle; y0 and z0 are those of a heel or a toe and cannot be compared."""

DURATION = _ACTIONS * PERIOD
"""Time after which motions are compared [s]."""

BALANCED, STEPPED = f"{OURS}, balanced", f"{OURS}, time steps"
DOP853, DOPRI5, ROSENBROCK = (f"{OURS}, {name}" for name in ("dop853", "dopri5", "rosenbrock"))
EULER, RK4, CENIC = "MuJoCo, Euler", "MuJoCo, RK4", "CENIC"
"""Methods, each with several settings; accuracy `fast` is a setting of `STEPPED`."""

FAST, REFERENCE = f"{OURS}, fast", f"{OURS}, reference"
USUAL = (FAST, f"{EULER}, {1e3 * STEP:g} ms")
"""Settings of the other tables."""


def case_of(scene: str) -> str:
    """Return the name of the comparison in a scene."""
    return f"{name_of(scene)}, by error"


def equal_steps(sizes: Sizes) -> Group:
    """Measure time and error of steps of both simulators at several accuracies."""
    entries: list[Entry] = []
    motions = len(SCENES) * (2 + len(_ACCURACIES) + len(_SETTINGS))
    with progress_bar(motions, "errors", "motion") as bar:
        for scene in SCENES:
            case = case_of(scene)
            entries += _ours(case, scene, bar.update)

            def theirs(case: str = case, scene: str = scene) -> Iterator[Entry]:
                return _theirs(case, scene, bar.update)

            entries += attempted(case, MUJOCO_ENV, "MuJoCo", theirs)
    group = measure("Environments by error", "one environment step", entries, sizes.long_rounds)
    group.rates = True
    integrator, step = _LIMIT
    group.notes = [
        f"The error of a start is the largest error of an angle [rad] after {_ACTIONS} actions, "
        f"{DURATION:g} s. The table gives median and 90 % quantile over {_STARTS} starts. Both "
        f"simulators have the same starts, perturbed by {PERTURB}, and the same random torques; "
        "IceSkate has the controller's torques as well. Errors are relative to the simulator's "
        f"own limit: accuracy `{_OUR_LIMIT}` for IceSkate, the same soft contact with "
        f"{integrator} and steps of {1e3 * step:g} ms for MuJoCo. The softness of MuJoCo's contact "
        "is therefore no error here.",
        f"Batches have {_BATCH} environments and one thread. Accuracy `fast` is `moreau 5 ms`. The "
        f"first step of an action is a quarter of the longest step, so `moreau 40 ms` makes one "
        f"step of {1e3 * PERIOD:g} ms per action. `balanced`, which is `dop853 1e-3` unless the "
        "motion is stiff, and the methods with a tolerance locate events; `dop853` makes its steps "
        "between events in lanes, `dopri5` and `rosenbrock` one robot at a time.",
        *ratio_notes(group, "MuJoCo", USUAL),
    ]
    return group


def method_of(row: Row) -> str:
    """Return the method of a row's setting."""
    if row.label == REFERENCE:
        return BALANCED
    named = (BALANCED, DOP853, DOPRI5, ROSENBROCK, EULER, RK4, CENIC)
    return next((name for name in named if row.label.startswith(name)), STEPPED)


def cost(group: Group, case: str, ours: bool, median: float) -> float | None:
    """Interpolate the time of a median error [s], for the cheapest method.

    None if no setting reaches the error, or nothing was measured.
    """
    costs = (
        cost_at(points, median)
        for method, points in settings(group, case).items()
        if method.startswith(OURS) is ours
    )
    return min((cost for cost in costs if cost is not None), default=None)


def settings(group: Group, case: str) -> dict[str, list[Point]]:
    """Return median error and time [s] of all settings of a case, by method."""
    found: dict[str, list[Point]] = {}
    for row in group.of(case):
        if row.error is not None and row.time is not None:
            found.setdefault(method_of(row), []).append(Point(row.error.median, row.time))
    return found


def ratio_notes(group: Group, peer: str, labels: Sequence[str]) -> list[str]:
    """Compare the times of both simulators at the errors of some settings, for every case."""
    notes = []
    for case in dict.fromkeys(row.case for row in group.rows):
        said = []
        for label in labels:
            error = median_error(group, case, label)
            if error is None:
                continue
            own, other = (cost(group, case, ours, error) for ours in (True, False))
            if own is not None and other is not None:
                said.append(f"{significant(other / own)} at the error of {label}")
        if said:
            notes.append(f"{peer}'s time divided by IceSkate's, {case}: {'; '.join(said)}.")
    return notes


def median_error(group: Group, case: str, label: str) -> float | None:
    """Return the median error of a setting; None where it was not measured."""
    rows = (row for row in group.of(case) if row.label == label)
    return next((row.error.median for row in rows if row.error is not None), None)


def _ours(case: str, scene: str, progress: Progress) -> Iterator[Entry]:
    limit = ends(scene, _OUR_LIMIT)
    progress()
    for accuracy in _ACCURACIES:
        found = error(ends(scene, accuracy), limit)
        progress()
        entry = vector(case, f"{OURS}, {accuracy}", scene, _BATCH, 1, accuracy=accuracy)
        yield replace(entry, size=None, error=found)


def _theirs(case: str, scene: str, progress: Progress) -> Iterator[Entry]:
    name, integrator, step = tool("MuJoCo", "mujoco"), *_LIMIT
    limit = mujoco_ends(MujocoSkateEnv(load_scene(scene), step, integrator), scene)
    progress()
    for integrator, step in _SETTINGS:
        env = MujocoSkateEnv(load_scene(scene), step, integrator)
        found = error(mujoco_ends(env, scene), limit)
        progress()
        what = f"gymnasium.Env with mj_step(nstep={round(PERIOD / step)}), {integrator}"
        label, block = f"MuJoCo, {integrator}, {1e3 * step:g} ms", episode(env)
        yield Entry(case, label, name, what, block, float(EPISODE), error=found)


def ends(scene: str, accuracy: str) -> Array:
    """Return the angles after the actions (starts, angles) [rad].

    Rows with a fall or a leg swap, after which angles have another meaning, are infinite.
    """
    envs, before = _begun(scene, accuracy)
    fallen = np.zeros(_STARTS, bool)
    for action in _actions(envs):
        fallen |= envs.step(action)[2]
    after = [envs.simulator(i) for i in range(_STARTS)]
    found = np.array([sim.q[ANGLES:] for sim in after])
    swapped = [a.support_leg != b.support_leg for a, b in zip(before, after, strict=True)]
    found[fallen | swapped] = np.inf
    return found


def mujoco_ends(env: MujocoSkateEnv, scene: str) -> Array:
    """Return the angles of `ends` in MuJoCo, for the same starts and actions."""
    envs, starts = _begun(scene, "fast")
    actions, found = _actions(envs), []
    for i, start in enumerate(starts):
        env.mj.mj_resetData(env.model, env.data)
        env.data.qpos[:], env.data.qvel[:] = start.q, start.v
        for action in actions:
            env.step(action[i])
        found.append(env.data.qpos[ANGLES:].copy())
    return np.array(found)


def error(found: Array, limit: Array) -> Error:
    """Compare motions with those of the limit; starts with an infinite limit are left out."""
    known = np.isfinite(limit).all(axis=1)
    off = np.abs(found[known] - limit[known]).max(axis=1)
    median, tenth = np.percentile(off, (50.0, 90.0), method="higher")
    return Error(float(median), float(tenth))


def _begun(scene: str, accuracy: str) -> tuple[IceSkateVectorEnv, list[Simulator]]:
    envs = new(scene, _STARTS, None, accuracy)
    envs.reset(seed=0)
    return envs, [envs.simulator(i) for i in range(_STARTS)]


def _actions(envs: IceSkateVectorEnv) -> NDArray[np.float32]:
    """Draw the actions (k, n, joints), the same for both simulators."""
    shape = (_ACTIONS, *(envs.action_space.shape or ()))
    return np.random.default_rng(1).uniform(-1.0, 1.0, shape).astype(np.float32)
