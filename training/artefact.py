"""What a training leaves behind for people: one small file, which `skate_env.policy` reads.

It holds the network, the normaliser, the scene, and the versions of what made them; using it takes
neither PyTorch nor Stable-Baselines3.
"""

import hashlib
import platform
from collections.abc import Mapping
from importlib.metadata import version
from typing import Any

import numpy as np
from skate_env.policy import Policy
from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import VecNormalize

from .course import Course

VERSIONS = ("skate-env", "stable-baselines3", "torch", "gymnasium", "numpy")


def policy_of(model: PPO, about: Mapping[str, Any]) -> Policy:
    """Take the policy out of a learner; joints that it does not move get rows of zeros.

    Parameters
    ----------
    model
        Its environments are a `Course` in a `VecNormalize`.
    about
        What else is worth knowing of the training; versions are added.
    """
    normaliser = model.get_env()
    assert isinstance(normaliser, VecNormalize)
    course = normaliser.venv
    assert isinstance(course, Course)
    state = model.policy.state_dict()
    hidden = [f"mlp_extractor.policy_net.{2 * i}" for i in range(len(model.policy.net_arch["pi"]))]
    layers = [
        tuple(state[f"{name}.{part}"].numpy() for part in ("weight", "bias"))
        for name in (*hidden, "action_net")
    ]
    every = course.batch.joint_names
    weight, bias = layers.pop()
    all_weight = np.zeros((len(every), weight.shape[1]), np.float32)
    all_bias, log_std = np.zeros((2, len(every)), np.float32)
    all_weight[course.joints], all_bias[course.joints] = weight, bias
    log_std[course.joints] = state["log_std"].numpy()
    made = {
        "python": platform.python_version(),
        "machine": platform.machine(),
        **{name: version(name) for name in VERSIONS},
    }
    return Policy(
        scene=course.batch.scene,
        layers=[*layers, (all_weight, all_bias)],
        log_std=log_std,
        mean=normaliser.obs_rms.mean,
        std=np.sqrt(normaliser.obs_rms.var + normaliser.epsilon),
        clip=normaliser.clip_obs,
        action_scale=course.torques,
        observation_names=course.batch.observation_names,
        joint_names=every,
        about={**about, "versions": made},
    )


def digest(policy: Policy) -> str:
    """Fingerprint of a policy's numbers (SHA-256): one seed has one, on one machine."""
    arrays = [array for layer in policy.layers for array in layer]
    arrays += [policy.log_std, policy.mean, policy.std]
    return hashlib.sha256(b"".join(array.tobytes() for array in arrays)).hexdigest()
