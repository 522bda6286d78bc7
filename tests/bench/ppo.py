"""Updates of PPO of Stable-Baselines3, which must be installed."""

import time
from collections.abc import Iterator
from typing import Any

import numpy as np
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.vec_env.base_vec_env import VecEnv

from skate_env.environments import PAPER_ACTIONS
from skate_env.sb3 import IceSkateVecEnv

from .environments import PERTURB, SCENES
from .null_env import NullVecEnv
from .peers import tool
from .states import PERIOD
from .table import Entry

# Prepared observations of every null environment.
_OBSERVATIONS = 16


class Update:
    """A table entry that times one update of PPO."""

    def __init__(self, case: str, label: str, venv: VecEnv, rollout: int, minibatch: int) -> None:
        self._timer = _RolloutTimer()
        self._whole: list[int] = []
        self._rollout = rollout
        self._model = PPO(
            "MlpPolicy",
            venv,
            n_steps=rollout // venv.num_envs,
            batch_size=min(minibatch, rollout),
            policy_kwargs={"log_std_init": -2.0},
            device="cpu",
            seed=0,
        )
        name = tool("Stable-Baselines3", "stable_baselines3")
        what = f"PPO.learn, one update after {rollout} steps"
        self.entry = Entry(case, label, name, what, self._block, float(rollout))

    def _block(self) -> int:
        before = time.perf_counter_ns()
        self._model.learn(self._rollout, callback=self._timer, reset_num_timesteps=False)
        self._whole.append(time.perf_counter_ns() - before)
        return self._whole[-1]

    @property
    def share(self) -> float:
        """Share of the rollout in the time of the fastest update."""
        fastest = int(np.argmin(self._whole))
        return self._timer.rollouts[fastest] / self._whole[fastest]


class _RolloutTimer(BaseCallback):
    """Measures the times of the rollouts [ns]."""

    def __init__(self) -> None:
        super().__init__()
        self.rollouts: list[int] = []
        self._begun = 0

    def _on_rollout_start(self) -> None:
        self._begun = time.perf_counter_ns()

    def _on_step(self) -> bool:
        return True

    def _on_rollout_end(self) -> None:
        self.rollouts.append(time.perf_counter_ns() - self._begun)


def pair(
    n: int, accuracy: str, names: tuple[str, str, str], rollout: int, minibatch: int
) -> Iterator[Update]:
    """Yield updates of PPO with IceSkate's environments and with null ones of the same spaces.

    ``names`` are the case and the labels of both.
    """
    case, own, null = names
    keywords: dict[str, Any] = {"scene": SCENES[0], "accuracy": accuracy, "action_period": PERIOD}
    ours = IceSkateVecEnv(n, perturb=PERTURB, num_threads=1, **keywords, **PAPER_ACTIONS)
    ours.action_space.seed(0)
    ours.reset()
    observations = []
    for _ in range(_OBSERVATIONS):
        ours.step_async(np.array([ours.action_space.sample() for _ in range(n)]))
        observations.append(ours.step_wait()[0])
    null_env = NullVecEnv(np.array(observations), ours.observation_space, ours.action_space)
    yield Update(case, own, ours, rollout, minibatch)
    yield Update(case, null, null_env, rollout, minibatch)
