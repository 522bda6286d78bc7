"""Export of a trained policy to a `skate_env.Policy`.

It holds the network, the normaliser, the scene, and the versions of what made them; using it takes
neither PyTorch nor Stable-Baselines3.
"""

import hashlib
import platform
from collections.abc import Mapping
from importlib.metadata import version
from typing import Any

import numpy as np
from stable_baselines3 import PPO

from ..policy import Policy
from .training_env import environments

VERSIONS = ("skate-env", "stable-baselines3", "torch", "gymnasium", "numpy")


def policy_of(model: PPO, about: Mapping[str, Any]) -> Policy:
    """Take the policy out of a learner; joints that it does not move get rows of zeros.

    Parameters
    ----------
    model
        Its environments are a `TrainingEnv` in a `VecNormalize`; TypeError otherwise.
    about
        What else is worth knowing of the training; versions are added.
    """
    normaliser, moments, env = environments(model)
    state = {name: tensor.numpy() for name, tensor in model.policy.state_dict().items()}
    weights = [name for name in state if name.startswith("mlp_extractor.policy_net")]
    names = [*weights, "action_net.weight", "action_net.bias"]
    # In pairs: weight, bias.
    layers = [(state[a], state[b]) for a, b in zip(names[::2], names[1::2], strict=True)]
    every = env.batch.joint_names
    weight, bias = layers.pop()
    all_weight = np.zeros((len(every), weight.shape[1]), np.float32)
    all_bias, log_std = np.zeros((2, len(every)), np.float32)
    all_weight[env.joints], all_bias[env.joints] = weight, bias
    log_std[env.joints] = state["log_std"]
    made = {
        "python": platform.python_version(),
        "machine": platform.machine(),
        **{name: version(name) for name in VERSIONS},
    }
    return Policy(
        scene=env.scene,
        layers=[*layers, (all_weight, all_bias)],
        log_std=log_std,
        mean=moments.mean,
        std=np.sqrt(moments.var + normaliser.epsilon),
        clip=normaliser.clip_obs,
        action_scale=env.torques,
        observation_names=env.batch.observation_names,
        joint_names=every,
        about={**about, "versions": made},
    )


def digest(policy: Policy) -> str:
    """Fingerprint of a policy's numbers (SHA-256): one seed has one, on one machine."""
    numbers = hashlib.sha256()
    for weight, bias in policy.layers:
        numbers.update(weight.tobytes() + bias.tobytes())
    for array in (policy.log_std, policy.mean, policy.std):
        numbers.update(array.tobytes())
    return numbers.hexdigest()
