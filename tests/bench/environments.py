"""Environment steps of IceSkate, of the same body in MuJoCo, and of well-known humanoids."""

from collections.abc import Iterator, Mapping
from functools import cache, partial
from typing import Any

import gymnasium
import numpy as np
from gymnasium.error import DependencyNotInstalled
from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray

from skate_env.environments import PAPER_ACTIONS, IceSkateVectorEnv
from skate_env.scenes import load_scene
from skate_env.studies import timing
from skate_env.studies.fixtures import PAPER_DAMPED, name_of
from skate_env.studies.timing import Block

from .mujoco_env import MujocoSkateEnv
from .peers import Unavailable, package, tool
from .sizes import Sizes
from .states import PERIOD, STEP
from .table import OURS, Entry, Group, attempted, measure

Actions = NDArray[np.float32]

SCENES = ("paper", PAPER_DAMPED, "push_only")
PERTURB = 0.02
ACCURACIES = ("balanced", "fast")
"""The default, and that for training."""
MUJOCO_ENV, HUMANOID = "MuJoCo, same body", "Humanoid-v5"
ROLLOUT = "mujoco.rollout, same body"
NO_LANES = "without lanes"

# Steps before a batch is measured, until its contact states are mixed, and number of action arrays
# that are used alternately. Half a second after the start most robots of `paper` still glide.
_MIXING, _ACTIONS = 400, 8
# Environment steps in a block: minimum for a batch, and number for a single environment.
_LEAST, EPISODE = 512, 100
_BATCH = 64

MOREAU: dict[str, Mapping[str, str | float]] = {
    f"moreau {1e3 * step:g} ms": {"method": "moreau", "step": step}
    for step in (0.04, 0.01, 0.0025, 0.00125)
}
LOCATED: dict[str, Mapping[str, str | float]] = {
    f"{method} {tolerance:.0e}".replace("e-0", "e-"): {"method": method, "tolerance": tolerance}
    for method, tolerances in (
        ("dop853", (1e-2, 1e-4, 5e-6)),
        ("dopri5", (1e-2, 1e-3, 1e-4)),
        ("rosenbrock", (1e-2, 1e-3, 1e-4)),
    )
    for tolerance in tolerances
}
"""Accuracies without a name in scenes, by their labels in tables."""


def case_of(accuracy: str) -> str:
    """Return the name of the comparison of environment steps at an accuracy."""
    return f"one environment step, `{accuracy}`"


def batch(scene: str) -> str:
    """Return the label of a scene's batch."""
    return f"{OURS}, {name_of(scene)}, batch"


def lanes_case(scene: str, accuracy: str) -> str:
    """Return the name of the comparison of a batch with and without SIMD lanes."""
    return f"batch with and without lanes, {name_of(scene)}, `{accuracy}`"


def environments(sizes: Sizes) -> Group:
    """Measure environment steps in one thread."""
    entries: list[Entry] = []
    for accuracy in ACCURACIES:
        case, n = case_of(accuracy), _batch_size(accuracy, sizes)
        entries += [vector(case, batch(s), s, n, 1, accuracy=accuracy) for s in SCENES]
        entries += [_single(scene, accuracy) for scene in SCENES]
        entries += attempted(case, MUJOCO_ENV, "MuJoCo", partial(_mujoco, case))
        if accuracy == "fast":
            entries += attempted(case, ROLLOUT, "MuJoCo", partial(_rollout, case))
            entries += attempted(case, HUMANOID, "Gymnasium", partial(_humanoid, case))
    for accuracy in ACCURACIES:
        for scene in SCENES:
            entries += _lanes(scene, accuracy, sizes)
    group = measure("Environments", "one environment step", entries, sizes.long_rounds)
    group.rates = True
    group.notes = [
        f"IceSkate: actions of {1e3 * PERIOD:g} ms, random within +-1 at the "
        f"default scales, starts perturbed by {PERTURB}, resets within the step. A batch is first "
        f"stepped {_MIXING} times ({PERIOD * _MIXING:g} s), and each block starts from the states "
        "after these steps.",
        "Everything runs in one thread. Ratios are to the batch of `paper`.",
        "A step of Humanoid holds an action for 15 ms, in five steps of RK4.",
    ]
    return group


def _batch_size(accuracy: str, sizes: Sizes) -> int:
    """Return a number of environments that keeps the rounds of `balanced` short."""
    return min(sizes.environments, 256) if accuracy == "balanced" else sizes.environments


def vector(
    case: str,
    label: str,
    scene: str,
    n: int,
    threads: int,
    lanes: int | None = None,
    accuracy: str = "fast",
) -> Entry:
    """Return an entry of a batch's steps; `size` is the number of environments.

    ``lanes`` is the number of environments per SIMD register, None for the processor's maximum.
    """
    envs = new(scene, n, threads, accuracy)
    saved, actions = _mixed(scene, n, accuracy)
    steps = max(2, _LEAST // n)
    lanes = envs._batch.lanes if lanes is None else lanes

    def prepare() -> None:
        envs.restore(saved)
        envs._batch.lanes = lanes
        # This step loads the threads' data into their caches.
        envs.step(actions[-1])

    def work() -> None:
        for i in range(steps):
            envs.step(actions[i % _ACTIONS])

    block = timing.timed(work, prepare)
    used = f"{lanes} lanes" if lanes > 1 else NO_LANES
    what = f"IceSkateVectorEnv of {n}, {used}, {threads} thread{'s' * (threads > 1)}"
    return Entry(case, label, OURS, what, block, float(steps * n), size=float(n))


def new(scene: str, n: int, threads: int | None, accuracy: str = "fast") -> IceSkateVectorEnv:
    """Build a batch; ``accuracy`` is a name, or a key of `MOREAU` or `LOCATED`."""
    return IceSkateVectorEnv(
        n,
        scene,
        accuracy=(MOREAU | LOCATED).get(accuracy, accuracy),
        action_period=PERIOD,
        perturb=PERTURB,
        num_threads=threads,
        autoreset_mode=AutoresetMode.SAME_STEP,
        **PAPER_ACTIONS,
    )


@cache
def _mixed(scene: str, n: int, accuracy: str) -> tuple[list[bytes], Actions]:
    """Return snapshots of a batch in mixed states, and actions (k, n, joints)."""
    envs = new(scene, n, None, accuracy)
    shape = (_ACTIONS, n, *(envs.single_action_space.shape or ()))
    actions = np.random.default_rng(0).uniform(-1.0, 1.0, shape).astype(np.float32)
    envs.reset(seed=0)
    for i in range(_MIXING):
        envs.step(actions[i % _ACTIONS])
    return envs.snapshot(), actions


def _lanes(scene: str, accuracy: str, sizes: Sizes) -> Iterator[Entry]:
    """Yield entries of the same batch with and without SIMD lanes."""
    case, n = lanes_case(scene, accuracy), _batch_size(accuracy, sizes)
    yield vector(case, batch(scene), scene, n, 1, accuracy=accuracy)
    yield vector(case, NO_LANES, scene, n, 1, lanes=1, accuracy=accuracy)


def _single(scene: str, accuracy: str) -> Entry:
    env = gymnasium.make(
        "IceSkate-v0",
        scene=scene,
        accuracy=accuracy,
        action_period=PERIOD,
        perturb=PERTURB,
        **PAPER_ACTIONS,
    )
    name = name_of(scene)
    what = f'gymnasium.make("IceSkate-v0", scene="{name}"), {EPISODE} steps from reset(seed=0)'
    label = f"IceSkate, gymnasium.make, {name}"
    return Entry(case_of(accuracy), label, OURS, what, episode(env), float(EPISODE))


def _mujoco(case: str) -> Iterator[Entry]:
    env = MujocoSkateEnv(load_scene("push_only"))
    what = (
        f"gymnasium.Env with mj_step(nstep={round(PERIOD / STEP)}) of {1e3 * STEP:g} ms, Euler, "
        f"soles touch the ice, {EPISODE} steps from reset(seed=0)"
    )
    yield Entry(case, MUJOCO_ENV, tool("MuJoCo", "mujoco"), what, episode(env), float(EPISODE))


def _humanoid(case: str) -> Iterator[Entry]:
    package("mujoco")
    try:
        env = gymnasium.make("Humanoid-v5")
    except DependencyNotInstalled as error:
        raise Unavailable(str(error)) from None
    what = f"gymnasium.make, {EPISODE} steps from reset(seed=0), random actions"
    name = tool("Gymnasium", "gymnasium")
    yield Entry(case, HUMANOID, name, what, episode(env), float(EPISODE))


def episode(env: "gymnasium.Env[Any, Any]") -> Block:
    """Return a block of random steps with resets at ends of episodes, the same in each round."""
    space = env.action_space
    space.seed(0)
    actions = [space.sample() for _ in range(EPISODE)]

    def work() -> None:
        for action in actions:
            _, _, terminated, truncated, _ = env.step(action)
            if terminated or truncated:
                env.reset()

    return timing.timed(work, lambda: env.reset(seed=0))


def _rollout(case: str) -> Iterator[Entry]:
    """Yield an entry of `mujoco.rollout` from states of an episode of its environment."""
    rollout = package("mujoco.rollout", "mujoco")
    env = MujocoSkateEnv(load_scene("push_only"))
    mj, model, spec = env.mj, env.model, env.mj.mjtState.mjSTATE_FULLPHYSICS
    env.action_space.seed(0)
    env.reset(seed=0)
    states = np.empty((_BATCH, mj.mj_stateSize(model, spec)))
    for state in states:
        mj.mj_getState(model, env.data, state, spec)
        if env.step(env.action_space.sample())[2]:
            env.reset()
    frames = round(PERIOD / STEP)
    torques = np.zeros((_BATCH, frames, model.nv))
    rng = np.random.default_rng(0)
    torques[:, :, 3:] = rng.uniform(-1.0, 1.0, (_BATCH, 1, model.nv - 3)) * env.torques
    out = np.empty((_BATCH, frames, states.shape[1]))
    data = mj.MjData(model)
    applied = mj.mjtState.mjSTATE_QFRC_APPLIED.value
    run = rollout.Rollout(nthread=0)

    def work() -> None:
        run.rollout(
            [model] * _BATCH,
            [data],
            states,
            torques,
            control_spec=applied,
            skip_checks=True,
            nstep=frames,
            state=out,
        )

    what = f"{_BATCH} states of the same environment in one call, nstep={frames}, no observations"
    yield Entry(case, ROLLOUT, tool("MuJoCo", "mujoco"), what, timing.timed(work), float(_BATCH))
