"""Stable-Baselines3's PPO on our environments, and on environments that cost nothing."""

import time
from collections.abc import Iterator
from typing import Any

import numpy as np

from ..timing import Block
from .environments import PERTURB, SCENES
from .extent import Extent
from .peers import Missing, package, tool
from .states import PERIOD
from .table import Entry, Group, Row, measure

SIZES = (64, 512)
FREE = "free environments"
_BATCH = 1024
_OBSERVATIONS = 16


def case_of(n: int) -> str:
    """Name the comparison with so many environments."""
    return f"PPO, {n} environments"


def learner(extent: Extent) -> Group:
    """Measure updates of PPO: rollout and gradient steps, in one thread."""
    title, unit = "Learning", "one environment step of an update"
    try:
        torch, _ = package("torch"), package("stable_baselines3", "stable-baselines3")
    except Missing as missing:
        rows = [Row(case_of(n), FREE, "PPO", "", reason=str(missing)) for n in SIZES]
        return Group(title, unit, 0, rows)
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        updates = [update for n in SIZES for update in _pair(n, extent.rollout)]
        entries = [update.entry for update in updates]
        group = measure(title, unit, entries, extent.updates)
    finally:
        torch.set_num_threads(threads)
    group.rates = True
    for row, update in zip(group.rows, updates, strict=True):
        row.what += f"; rollouts are {update.share:.0%} of the time"
    group.notes = [
        f"PPO of Stable-Baselines3, MlpPolicy 2 x 64, {extent.rollout} environment steps an update, "
        f"minibatches of {min(_BATCH, extent.rollout)}, 10 epochs, on the CPU; torch and "
        f"environments in one thread. Scene {SCENES[0]}, accuracy `fast`. Free environments give "
        "observations that were recorded before.",
    ]
    return group


class _Update:
    """PPO, one update of which is a block."""

    def __init__(self, case: str, label: str, venv: Any, rollout: int) -> None:
        ppo = package("stable_baselines3").PPO
        callbacks = package("stable_baselines3.common.callbacks")
        rest = self

        class Watch(callbacks.BaseCallback):  # type: ignore[misc]
            """Time the rollouts."""

            def _on_rollout_start(self) -> None:
                rest.begun = time.perf_counter_ns()

            def _on_step(self) -> bool:
                return True

            def _on_rollout_end(self) -> None:
                rest.rollouts.append(time.perf_counter_ns() - rest.begun)

        self.begun = 0
        self.rollouts: list[int] = []
        self.whole: list[int] = []
        model = ppo(
            "MlpPolicy",
            venv,
            n_steps=rollout // venv.num_envs,
            batch_size=min(_BATCH, rollout),
            policy_kwargs={"log_std_init": -2.0},
            device="cpu",
            seed=0,
        )
        watch = Watch()

        def block() -> int:
            before = time.perf_counter_ns()
            model.learn(rollout, callback=watch, reset_num_timesteps=False)
            self.whole.append(time.perf_counter_ns() - before)
            return self.whole[-1]

        self.block: Block = block
        name = tool("Stable-Baselines3", "stable_baselines3")
        self.entry = Entry(case, label, name, "PPO.learn, one update", block, float(rollout))

    @property
    def share(self) -> float:
        """Share of the rollouts in the quickest update."""
        quickest = int(np.argmin(self.whole))
        return self.rollouts[quickest] / self.whole[quickest]


def _pair(n: int, rollout: int) -> Iterator[_Update]:
    """Make PPO with our environments and with free ones of the same spaces."""
    from ..sb3 import IceSkateVecEnv
    from .free_env import FreeVecEnv

    keywords: dict[str, Any] = {"scene": SCENES[0], "accuracy": "fast", "action_period": PERIOD}
    ours = IceSkateVecEnv(n, perturb=PERTURB, num_threads=1, **keywords)
    space = ours.action_space
    space.seed(0)
    seen = [ours.reset()]
    for _ in range(_OBSERVATIONS - 1):
        seen.append(ours.step(np.array([space.sample() for _ in range(n)]))[0])
    free = FreeVecEnv(np.array(seen), ours.observation_space, space)
    yield _Update(case_of(n), "IceSkateVecEnv", ours, rollout)
    yield _Update(case_of(n), FREE, free, rollout)
