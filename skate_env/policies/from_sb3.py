"""Policies of Stable-Baselines3 as the fields of a `Policy`."""

import sys
from importlib.metadata import version
from typing import TYPE_CHECKING, Any

import numpy as np

from ..environments import joints
from .checks import MOST

if TYPE_CHECKING:
    import gymnasium
    from stable_baselines3.common.on_policy_algorithm import OnPolicyAlgorithm
    from stable_baselines3.common.vec_env import VecEnv, VecNormalize


def fields(
    model: "OnPolicyAlgorithm",
    env: "VecEnv | gymnasium.Env[Any, Any]",
    normaliser: "VecNormalize | None",
) -> dict[str, Any]:
    """Return the fields of `Policy.from_sb3`; joints without an action get rows of zeros."""
    *hidden, (weight, bias), log_std = network(model)
    from stable_baselines3.common.vec_env import VecEnv, unwrap_vec_normalize

    if normaliser is None and isinstance(env, VecEnv):
        normaliser = unwrap_vec_normalize(env)
    scene, names, moved, scale, mirrored = (
        attribute(env, name)
        for name in ("scene", "observation_names", "joint_names", "action_scale", "mirrored")
    )
    if not mirrored:
        raise ValueError("env: mirrored = False; a Policy mirrors the states with left support")
    if len(bias) != len(moved):
        raise ValueError(f"model: {len(bias)} actions, but env has {len(moved)} joints")
    every = joints(scene)
    chosen = [every.index(joint) for joint in moved]
    weights, biases = np.zeros((len(every), weight.shape[1])), np.zeros(len(every))
    noise = np.zeros(len(every))
    weights[chosen], biases[chosen], noise[chosen] = weight, bias, log_std
    mean, std, clip = moments(normaliser, len(names))
    libraries = ("skate-env", "stable-baselines3", "torch", "gymnasium", "numpy")
    return {
        "scene": scene,
        "layers": [*hidden, (weights, biases)],
        "log_std": noise,
        "mean": mean,
        "std": std,
        "clip": clip,
        "action_scale": dict.fromkeys(every, 0.0) | scale,
        "observation_names": names,
        "joint_names": every,
        "about": {
            "algorithm": type(model).__name__,
            "actions": model.num_timesteps,
            "versions": {name: version(name) for name in libraries},
        },
    }


def network(model: "OnPolicyAlgorithm") -> list[Any]:
    """Return pairs of weight and bias of the layers, then the logarithm of the noise."""
    policy = getattr(model, "policy", None)
    wanted = "model: must have an actor and a critic, as the MlpPolicy of PPO and A2C"
    # Whoever has a model has loaded the library, which takes seconds.
    if "stable_baselines3" not in sys.modules:
        raise TypeError(wanted)
    from stable_baselines3.common.policies import ActorCriticPolicy
    from stable_baselines3.common.torch_layers import FlattenExtractor
    from torch import nn

    if not isinstance(policy, ActorCriticPolicy):
        raise TypeError(wanted)
    parts = [*policy.mlp_extractor.policy_net, policy.action_net]
    plain = isinstance(policy.pi_features_extractor, FlattenExtractor) and not policy.use_sde
    linear = all(isinstance(part, nn.Linear) for part in parts[::2])
    if not (plain and linear and all(isinstance(part, nn.Tanh) for part in parts[1::2])):
        raise TypeError("model: must be a perceptron with tanh, without state-dependent noise")
    layers = [tuple(x.detach().cpu().numpy() for x in part.parameters()) for part in parts[::2]]
    return [*layers, policy.log_std.detach().cpu().numpy()]


def attribute(env: Any, name: str) -> Any:
    """Return an attribute of the environment, or of the first of many, below all wrappers."""
    try:
        if hasattr(env, "get_attr"):
            return env.get_attr(name, 0)[0]
        return getattr(env.unwrapped, name)
    except AttributeError:
        raise TypeError(f"env: no environment of IceSkate, it has no {name}") from None


def moments(normaliser: "VecNormalize | None", d: int) -> tuple[Any, Any, float]:
    """Return mean, standard deviation and limit of the normalised observations."""
    if normaliser is None or not normaliser.norm_obs:
        return np.zeros(d), np.ones(d), MOST
    found: Any = normaliser.obs_rms
    return found.mean, np.sqrt(found.var + normaliser.epsilon), normaliser.clip_obs
