"""The mean of a learner's weights over a part of its training."""

import torch
from stable_baselines3 import PPO


class Average:
    """Mean of the weights after each update (Polyak and Juditsky 1992).

    What single updates gain in one scene and lose in another one averages out.
    """

    def __init__(self) -> None:
        self._count = 0
        self._mean: dict[str, torch.Tensor] = {}

    def add(self, model: PPO) -> None:
        """Include the present weights."""
        self._count += 1
        for name, tensor in model.policy.state_dict().items():
            mean = self._mean.setdefault(name, torch.zeros_like(tensor, dtype=torch.float64))
            mean += (tensor - mean) / self._count

    def apply(self, model: PPO) -> None:
        """Give the learner the mean, if there is one."""
        if self._mean:
            model.policy.load_state_dict(self._mean)
