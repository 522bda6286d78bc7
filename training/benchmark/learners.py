"""Settings of learners that are in common use, as arguments of Stable-Baselines3."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import torch

# Time steps of 1 ms in training; evaluations have the default accuracy.
COARSE = {"method": "moreau", "step": 0.001}


@dataclass(frozen=True)
class Learner:
    """One row of the benchmark.

    Attributes
    ----------
    source
        Where the settings come from.
    algorithm
        Class of Stable-Baselines3 or, for ``TQC``, of sb3-contrib.
    actions
        Total number of actions.
    environments
        Number of environments.
    normalise
        Whether observations and rewards are normalised.
    accuracy
        Accuracy of training; None for the default.
    settings
        Arguments of the algorithm that differ from its defaults.
    reward
        Weights and limits of the reward in training that differ from those of the id.
    """

    source: str
    algorithm: str = "PPO"
    actions: int = 1_000_000
    environments: int = 8
    normalise: bool = False
    accuracy: Mapping[str, Any] | str | None = None
    settings: Mapping[str, Any] = field(default_factory=dict)
    reward: Mapping[str, float] | None = None


def _falling(rate: float) -> Any:
    """Return a learning rate that falls linearly to 0."""
    return lambda left: rate * left


_EXAMPLE = Learner(
    "docs/examples/ppo.py",
    actions=1_500_000,
    environments=64,
    normalise=True,
    accuracy=COARSE,
    settings={
        "n_steps": 64,
        "batch_size": 2048,
        "n_epochs": 10,
        "gamma": 0.99,
        "learning_rate": _falling(1e-3),
        "policy_kwargs": {"log_std_init": -0.5},
    },
)
LEARNERS = {
    "example": _EXAMPLE,
    "example_fast": replace(_EXAMPLE, source="the same, time steps of 5 ms", accuracy="fast"),
    "example_balanced": replace(_EXAMPLE, source="the same, the default accuracy", accuracy=None),
    "ppo": Learner("Stable-Baselines3 2, defaults of PPO with make_vec_env"),
    "cleanrl": Learner(
        "CleanRL, ppo_continuous_action.py",
        environments=1,
        normalise=True,
        settings={
            "n_steps": 2048,
            "batch_size": 64,
            "n_epochs": 10,
            "learning_rate": _falling(3e-4),
            "clip_range_vf": 0.2,
        },
    ),
    "zoo": Learner(
        "RL Baselines3 Zoo, PPO for Humanoid-v4",
        environments=1,
        normalise=True,
        settings={
            "n_steps": 512,
            "batch_size": 256,
            "n_epochs": 5,
            "gamma": 0.95,
            "gae_lambda": 0.9,
            "learning_rate": 3.56987e-05,
            "ent_coef": 0.00238306,
            "clip_range": 0.3,
            "max_grad_norm": 2.0,
            "vf_coef": 0.431892,
            "policy_kwargs": {
                "log_std_init": -2.0,
                "ortho_init": False,
                "activation_fn": torch.nn.ReLU,
                "net_arch": {"pi": [256, 256], "vf": [256, 256]},
            },
        },
    ),
    # SB3 has no penalty of the Kullback-Leibler divergence and no limit on the critic's loss.
    "rllib": Learner(
        "RLlib 2, defaults of PPO without its penalty of the divergence",
        environments=1,
        settings={
            "n_steps": 4000,
            "batch_size": 128,
            "n_epochs": 30,
            "learning_rate": 5e-5,
            "gae_lambda": 1.0,
            "clip_range": 0.3,
            "vf_coef": 1.0,
            "max_grad_norm": 1e9,
            "policy_kwargs": {"net_arch": {"pi": [256, 256], "vf": [256, 256]}},
        },
    ),
    "sac": Learner("Stable-Baselines3 2, defaults of SAC", "SAC", 300_000, 1),
    "tqc": Learner("sb3-contrib 2, defaults of TQC", "TQC", 300_000, 1),
}
"""Learners by the name that ``python -m training.benchmark train --learner`` takes."""
# The example without a term or limit of the reward.
_WITHOUT = {
    "slide": 0.0,
    "head": 0.0,
    "flight": 0.0,
    "speed": 0.0,
    "fall": 0.0,
    "longest_step": 30.0,
}
for _name, _value in _WITHOUT.items():
    LEARNERS[f"without_{_name}"] = replace(
        _EXAMPLE, source=f"the same, {_name} = {_value:g}", reward={_name: _value}
    )
