"""Cost of resets, snapshots and restores."""

from collections.abc import Callable, Iterator

import gymnasium
import numpy as np

from skate_env._core import Scene, Simulator
from skate_env.environments import IceSkateVectorEnv
from skate_env.scenes import load_scene, replace
from skate_env.studies import timing
from skate_env.studies.timing import Block

from .environments import PERTURB
from .mujoco_env import MujocoSkateEnv
from .peers import tool
from .sizes import Sizes
from .table import OURS, Entry, Group, attempted, measure

RESET, SAVE, RESTORE = "reset", "snapshot", "restore"
SCENE = "push_only"
_REPEATS, _BATCH = 20, 64
# Numbers that are randomised for each episode.
_DRAWN = {"ice.friction.mu_forward": [0.2, 0.4], "body.upper_body.mass": [20.0, 23.0]}


def resets(sizes: Sizes) -> Group:
    """Measure resets with and without randomisation, snapshots and restores."""
    scene = replace(load_scene(SCENE), {"accuracy": "fast"})
    drawn = replace(scene, {"randomise": _DRAWN})
    sim = Simulator(scene)
    sim.advance(0.1)
    snapshot = sim.snapshot()
    entries = [_engine(RESET, "Simulator.reset, the same start", Simulator(scene).reset)]
    entries += [
        _batch("IceSkate, batch", scene, 0.0, "the same start"),
        _batch("IceSkate, batch, perturbed", scene, PERTURB, f"perturb={PERTURB}"),
        _batch("IceSkate, batch, randomised", drawn, 0.0, f"{len(_DRAWN)} numbers randomised"),
        _single(scene),
    ]
    entries += attempted(RESET, "MuJoCo, same body", "MuJoCo", _mujoco_reset)
    saved = "complete state with the scene's numbers"
    entries.append(_engine(SAVE, f"Simulator.snapshot, {saved}", sim.snapshot))
    entries += attempted(SAVE, "MuJoCo, same body", "MuJoCo", lambda: _mujoco_state(SAVE))
    what = "Simulator.restore, checked for damage"
    entries.append(_engine(RESTORE, what, lambda: sim.restore(snapshot)))
    entries += attempted(RESTORE, "MuJoCo, same body", "MuJoCo", lambda: _mujoco_state(RESTORE))
    group = measure("Resets and snapshots", "one", entries, sizes.rounds)
    group.notes = [
        f"Scene {SCENE}, accuracy `fast`. IceSkate's reset determines the contact state and solves "
        "for its forces. A snapshot holds the complete state, the scene's numbers included, and is "
        "checked for damage. MuJoCo's reset sets numbers without an evaluation, and its state is "
        "an array of numbers."
    ]
    return group


def _engine(case: str, what: str, call: Callable[[], object]) -> Entry:
    return Entry(case, "IceSkate, engine", OURS, what, _timed(call, _REPEATS), _REPEATS)


def _batch(label: str, scene: Scene, perturb: float, how: str) -> Entry:
    envs = IceSkateVectorEnv(_BATCH, scene, perturb=perturb, num_threads=1)
    block = _timed(lambda: envs.reset(seed=0), 1)
    return Entry(RESET, label, OURS, f"IceSkateVectorEnv of {_BATCH}, {how}", block, _BATCH)


def _single(scene: Scene) -> Entry:
    env = gymnasium.make("IceSkate-v0", scene=scene, perturb=PERTURB)
    block = _timed(lambda: env.reset(seed=0), _REPEATS)
    what = f"gymnasium.make, reset(seed=0), perturb={PERTURB}"
    return Entry(RESET, "IceSkate, one environment", OURS, what, block, _REPEATS)


def _mujoco_reset() -> Iterator[Entry]:
    env = MujocoSkateEnv(load_scene(SCENE))
    block = _timed(lambda: env.reset(seed=0), _REPEATS)
    what = "gymnasium.Env, reset(seed=0): mj_resetData, noise"
    yield Entry(RESET, "MuJoCo, same body", tool("MuJoCo", "mujoco"), what, block, _REPEATS)


def _mujoco_state(case: str) -> Iterator[Entry]:
    env = MujocoSkateEnv(load_scene(SCENE))
    mj, model, data = env.mj, env.model, env.data
    spec = mj.mjtState.mjSTATE_INTEGRATION
    state = np.empty(mj.mj_stateSize(model, spec))
    call = mj.mj_getState if case == SAVE else mj.mj_setState
    mj.mj_getState(model, data, state, spec)
    block = _timed(lambda: call(model, data, state, spec), _REPEATS)
    label, name = "MuJoCo, same body", tool("MuJoCo", "mujoco")
    yield Entry(case, label, name, f"{call.__name__}, complete state", block, _REPEATS)


def _timed(call: Callable[[], object], repeats: int) -> Block:
    def work() -> None:
        for _ in range(repeats):
            call()

    return timing.timed(work)
