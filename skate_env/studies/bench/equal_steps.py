"""What environment steps cost and how exact they are: ours, and MuJoCo's of the same body."""

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..._core import Simulator
from ...progress import progress_bar
from ...scenes import load_scene
from ...vector import IceSkateVectorEnv
from ..accuracy.curves import Point, cost_at
from .environments import EPISODE, MOREAU, MUJOCO_ENV, PERTURB, SCENES, episode, new, vector
from .mujoco_env import MujocoSkateEnv
from .peers import tool
from .sizes import Extent
from .states import PERIOD, STEP
from .table import OURS, Entry, Error, Group, Row, attempted, measure

Array = NDArray[np.float64]
Progress = Callable[[], object]

# Actions after which motions are compared, starts of which they are made, environments of a batch.
_ACTIONS, _STARTS, _BATCH = 10, 64, 256
# Where angles begin among coordinates; the place of a foot is that of its heel or its toe.
_ANGLES = 2
_ACCURACIES = ("fast", "balanced", *MOREAU)
# MuJoCo's integrators and timesteps [s]; RK4 is not stable at longer ones.
_SETTINGS = (
    *(("Euler", step) for step in (5e-3, STEP, 1.25e-3, 6.25e-4, 3.125e-4, 1.5625e-4, 5e-5)),
    *(("RK4", step) for step in (1.25e-3, 6.25e-4, 3.125e-4)),
)
# What the others are compared with.
_OUR_LIMIT, _LIMIT = "reference", ("RK4", 1e-5)

DURATION = _ACTIONS * PERIOD
"""After which motions are compared [s]."""

BALANCED, STEPPED = f"{OURS}, balanced", f"{OURS}, time steps"
EULER, RK4 = "MuJoCo, Euler", "MuJoCo, RK4"
"""Methods, each with settings of its own; accuracy `fast` is one of the second's."""

USUAL = {True: f"{OURS}, fast", False: f"{EULER}, {1e3 * STEP:g} ms"}
"""What the other tables are of: ours, and MuJoCo's."""


def case_of(scene: str) -> str:
    """Name the comparison in a scene."""
    return f"{scene}, by error"


def equal_steps(extent: Extent) -> Group:
    """Measure steps of both at several accuracies, and how exact each of them is."""
    entries: list[Entry] = []
    motions = len(SCENES) * (2 + len(_ACCURACIES) + len(_SETTINGS))
    with progress_bar(motions, "errors", "motion") as bar:
        for scene in SCENES:
            case = case_of(scene)
            entries += _ours(case, scene, bar.update)

            def theirs(case: str = case, scene: str = scene) -> Iterator[Entry]:
                return _theirs(case, scene, bar.update)

            entries += attempted(case, MUJOCO_ENV, "MuJoCo", theirs)
    group = measure("Environments by error", "one environment step", entries, extent.long_rounds)
    group.rates = True
    integrator, step = _LIMIT
    group.notes = [
        f"Errors are those after {_ACTIONS} actions, {DURATION:g} s: of each of {_STARTS} "
        "starts the largest of all angles [rad]: their median, and what one in ten "
        f"exceeds. Both begin at the same starts, disturbed by {PERTURB}, under the same random "
        "torques; ours have the controller's as well. Each is compared with its own limit: ours "
        f"with accuracy `{_OUR_LIMIT}`, MuJoCo's with the same soft contact at {1e3 * step:g} ms "
        f"and {integrator}. That its contact is soft does not count.",
        f"Batches have {_BATCH} environments and one thread. Accuracy `fast` is `moreau 5 ms`; "
        f"the first step of an action is a quarter of that, so that `moreau 40 ms` makes one of "
        f"{1e3 * PERIOD:g} ms of each. `balanced` locates events and uses no lanes.",
    ]
    return group


def method_of(row: Row) -> str:
    """Say which method a row is a setting of."""
    named = (BALANCED, EULER, RK4)
    return next((name for name in named if row.label.startswith(name)), STEPPED)


def cost(group: Group, scene: str, ours: bool, median: float) -> float | None:
    """Give the time of a step with this error [s], between a method's settings interpolated.

    Of several methods the cheapest counts. None where no setting is as exact, or nothing was
    measured.
    """
    costs = (
        cost_at(points, median)
        for method, points in settings(group, scene).items()
        if method.startswith(OURS) is ours
    )
    return min((cost for cost in costs if cost is not None), default=None)


def settings(group: Group, scene: str) -> dict[str, list[Point]]:
    """Place every method's settings by their median error and the time of a step [s]."""
    found: dict[str, list[Point]] = {}
    for row in group.of(case_of(scene)):
        if row.error is not None and row.time is not None:
            found.setdefault(method_of(row), []).append(Point(row.error.median, row.time))
    return found


def usual(group: Group, scene: str, ours: bool) -> float | None:
    """Give the median error of `fast`, or of the steps that MuJoCo's environment makes."""
    rows = (row for row in group.of(case_of(scene)) if row.label == USUAL[ours])
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
    """Give the angles after the actions (starts, angles) [rad]; infinite after a fall or a swap.

    What stands on another leg counts them differently.
    """
    envs, before = _begun(scene, accuracy)
    fallen = np.zeros(_STARTS, bool)
    for action in _actions(envs):
        fallen |= envs.step(action)[2]
    after = [envs.simulator(i) for i in range(_STARTS)]
    found = np.array([sim.q[_ANGLES:] for sim in after])
    swapped = [a.support_leg != b.support_leg for a, b in zip(before, after, strict=True)]
    found[fallen | swapped] = np.inf
    return found


def mujoco_ends(env: MujocoSkateEnv, scene: str) -> Array:
    """Give the same in MuJoCo, after the same actions from the same starts."""
    envs, starts = _begun(scene, "fast")
    actions, found = _actions(envs), []
    for i, start in enumerate(starts):
        env.mj.mj_resetData(env.model, env.data)
        env.data.qpos[:], env.data.qvel[:] = start.q, start.v
        for action in actions:
            env.step(action[i])
        found.append(env.data.qpos[_ANGLES:].copy())
    return np.array(found)


def error(found: Array, limit: Array) -> Error:
    """Compare motions with those in the limit, as far as these can be compared with any."""
    known = np.isfinite(limit).all(axis=1)
    off = np.abs(found[known] - limit[known]).max(axis=1)
    median, tenth = np.percentile(off, (50.0, 90.0), method="higher")
    return Error(float(median), float(tenth))


def _begun(scene: str, accuracy: str) -> tuple[IceSkateVectorEnv, list[Simulator]]:
    envs = new(scene, _STARTS, None, accuracy)
    envs.reset(seed=0)
    return envs, [envs.simulator(i) for i in range(_STARTS)]


def _actions(envs: IceSkateVectorEnv) -> NDArray[np.float32]:
    """Draw the actions, the same for both."""
    shape = (_ACTIONS, *(envs.action_space.shape or ()))
    return np.random.default_rng(1).uniform(-1.0, 1.0, shape).astype(np.float32)
