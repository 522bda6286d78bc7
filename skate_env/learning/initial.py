"""A training that begins with the network of a policy."""

from collections.abc import Iterator

import numpy as np
import torch
from stable_baselines3 import PPO

from ..policies import Policy
from .checkpoint import environments

# Number of observations that the statistics of the policy count for: later ones hardly change them.
_OBSERVATIONS = 1e7
_HIDDEN, _OUTPUT = "mlp_extractor.policy_net", "action_net"


def take_over(model: PPO, policy: Policy) -> None:
    """Give a new learner the actor and the observation statistics of a policy.

    Noise and critic remain those of the learner.

    Raises
    ------
    ValueError
        If observations, joints, scales or layers of learner and policy differ.
    """
    normaliser, moments, env = environments(model)
    batch = env.batch
    if list(policy.observation_names) != list(batch.observation_names):
        raise ValueError("the policy has other observations than the scene")
    scale = batch.action_scale
    unlike = [each for each in batch.joint_names if policy.action_scale.get(each) != scale[each]]
    if unlike:
        raise ValueError(f"the policy has another scale or no action of {', '.join(unlike)}")
    chosen = [list(policy.joint_names).index(joint) for joint in batch.joint_names]
    (*hidden, (weight, bias)), state = policy.layers, model.policy.state_dict()
    names = [name for name in state if name.startswith((_HIDDEN, _OUTPUT))]
    given = [array for layer in (*hidden, (weight[chosen], bias[chosen])) for array in layer]
    shapes = [tuple(state[name].shape) for name in names]
    if shapes != [array.shape for array in given]:
        widths = [layer.shape[0] for layer, _ in hidden]
        raise ValueError(f"the policy has the layers {widths}: --set layers={widths}")
    for name, array in zip(names, given, strict=True):
        state[name] = torch.tensor(array)
    model.policy.load_state_dict(state)
    moments.mean = np.array(policy.mean)
    moments.var = policy.std**2 - normaliser.epsilon
    moments.count = _OBSERVATIONS


def actor(model: PPO) -> Iterator[torch.nn.Parameter]:
    """Yield the parameters of the actor, noise included."""
    for name, parameter in model.policy.named_parameters():
        if name.startswith((_HIDDEN, _OUTPUT, "log_std")):
            yield parameter
