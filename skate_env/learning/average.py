"""Means of weights: of a learner over a part of its training, and of several policies."""

import dataclasses
from collections.abc import Sequence

import numpy as np
import torch
from numpy.typing import NDArray
from stable_baselines3 import PPO

from ..policies import Policy
from .export import digest


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


def mean_of(policies: Sequence[Policy], counts: Sequence[int] | None = None) -> Policy:
    """Return the policy whose weights are the mean of those of several trainings.

    They must have begun with the same policy: then the mean is often better than each (Wortsman et
    al. 2022, "Model soups"). First layers are averaged as functions of the observations before
    normalisation. Scene, noise and normalisation are those of the first policy. `counts` is how
    often each policy counts; by default once.

    Raises
    ------
    ValueError
        If there is no policy, if observations, joints, scales or layers differ, or if `counts`
        does not have one positive number for each policy.
    """
    if not policies:
        raise ValueError("the mean needs at least one policy")
    counts = [1] * len(policies) if counts is None else list(counts)
    if len(counts) != len(policies) or min(counts) < 1:
        raise ValueError(f"counts = {counts}: must be one number >= 1 for each policy")
    first = policies[0]
    for policy in policies[1:]:
        for name in ("observation_names", "joint_names", "action_scale", "clip"):
            if getattr(policy, name) != getattr(first, name):
                raise ValueError(f"the mean of policies: their {name} differ")
        if [w.shape for w, _ in policy.layers] != [w.shape for w, _ in first.layers]:
            raise ValueError("the mean of policies: their layers differ")
    shares, layers = [count / sum(counts) for count in counts], []
    for i in range(len(first.layers)):
        weights: list[NDArray[np.floating]] = []
        biases: list[NDArray[np.floating]] = []
        for policy, share in zip(policies, shares, strict=True):
            weight, bias = policy.layers[i]
            if i == 0:
                raw = weight / policy.std
                weights.append(share * (raw * first.std))
                biases.append(share * (bias - raw @ policy.mean + raw @ first.mean))
            else:
                weights.append(share * weight)
                biases.append(share * bias)
        layer = np.sum(weights, axis=0), np.sum(biases, axis=0)
        layers.append((layer[0].astype(np.float32), layer[1].astype(np.float32)))
    about = {"mean_of": [digest(policy) for policy in policies], "counts": counts}
    return dataclasses.replace(first, layers=layers, about=about)
