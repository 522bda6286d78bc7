"""Export of a trained policy to a `skate_env.Policy`.

It holds the network, the normaliser, the scene and the versions of the libraries. Its use requires
neither PyTorch nor Stable-Baselines3.
"""

import hashlib
import platform
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from stable_baselines3 import PPO

from .._core import Scene
from ..policies import Policy
from .checkpoint import environments


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
    normaliser, _, env = environments(model)
    made = Policy.from_sb3(model, env, normaliser)
    machine = {"python": platform.python_version(), "machine": platform.machine()}
    versions = machine | made.about["versions"]
    return replace(made, scene=scene, about={**about, "versions": versions})


def digest(policy: Policy) -> str:
    """SHA-256 hash of a policy's numbers; on one machine it depends on the seed only."""
    numbers = hashlib.sha256()
    for weight, bias in policy.layers:
        numbers.update(weight.tobytes() + bias.tobytes())
    for array in (policy.log_std, policy.mean, policy.std):
        numbers.update(array.tobytes())
    return numbers.hexdigest()
