"""Export of a trained policy to a `skate_env.Policy`.

It holds the network, the normaliser, the scene and the versions of the libraries. Its use requires
neither PyTorch nor Stable-Baselines3.
"""

import hashlib
import platform
from collections.abc import Mapping
from importlib.metadata import version
from typing import Any

import numpy as np
from stable_baselines3 import PPO

from .._core import Scene
from ..environments import joints
from ..policies import Policy
from .checkpoint import environments

VERSIONS = ("skate-env", "stable-baselines3", "torch", "gymnasium", "numpy")


def policy_of(model: PPO, scene: Scene, about: Mapping[str, Any]) -> Policy:
    """Export the policy of a learner; joints without an action get rows of zeros.

    Parameters
    ----------
    model
        Learner with an `IceSkateVecEnv` in a `VecNormalize`; raises TypeError for others.
    scene
        Scene of the policy, with the accuracy at which it is used.
    about
        Further data of the training; versions are added.
    """
    normaliser, moments, env = environments(model)
    state = {name: tensor.numpy() for name, tensor in model.policy.state_dict().items()}
    weights = [name for name in state if name.startswith("mlp_extractor.policy_net")]
    names = [*weights, "action_net.weight", "action_net.bias"]
    # Pairs of weight and bias.
    layers = [(state[a], state[b]) for a, b in zip(names[::2], names[1::2], strict=True)]
    every, batch = joints(scene), env.batch
    chosen = [every.index(joint) for joint in batch.joint_names]
    weight, bias = layers.pop()
    all_weight = np.zeros((len(every), weight.shape[1]), np.float32)
    all_bias, log_std = np.zeros((2, len(every)), np.float32)
    all_weight[chosen], all_bias[chosen] = weight, bias
    log_std[chosen] = state["log_std"]
    torques = dict.fromkeys(every, 0.0)
    torques |= {joint: batch.action_scale[joint] for joint in batch.joint_names}
    made = {
        "python": platform.python_version(),
        "machine": platform.machine(),
        **{name: version(name) for name in VERSIONS},
    }
    return Policy(
        scene=scene,
        layers=[*layers, (all_weight, all_bias)],
        log_std=log_std,
        mean=moments.mean,
        std=np.sqrt(moments.var + normaliser.epsilon),
        clip=normaliser.clip_obs,
        action_scale=torques,
        observation_names=batch.observation_names,
        joint_names=every,
        about={**about, "versions": made},
    )


def digest(policy: Policy) -> str:
    """SHA-256 hash of a policy's numbers; on one machine it depends on the seed only."""
    numbers = hashlib.sha256()
    for weight, bias in policy.layers:
        numbers.update(weight.tobytes() + bias.tobytes())
    for array in (policy.log_std, policy.mean, policy.std):
        numbers.update(array.tobytes())
    return numbers.hexdigest()
