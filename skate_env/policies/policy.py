"""A learned policy in one file, which is used without the library that trained it.

It consists of a normaliser, a multilayer perceptron and a torque scale::

    policy = skate_env.Policy.load("policy.npz")
    env = gymnasium.make("IceSkate-v0", **policy.environment())
    observation, info = env.reset(seed=0)
    action, _ = policy.predict(observation)
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from .._core import Scene
from ..common import seed_of
from . import archive, checks, from_sb3
from .checks import Array, Layer
from .residual import Residual, Single

if TYPE_CHECKING:
    import gymnasium
    from stable_baselines3.common.on_policy_algorithm import OnPolicyAlgorithm
    from stable_baselines3.common.vec_env import VecEnv, VecNormalize

# Ranges of the logarithms of the noise, and of deviations and clip limit.
_LOG_STD, _LEAST = (-20.0, 5.0), 1e-6


@dataclass(frozen=True, eq=False)
class Policy(Residual):
    """A learned residual on top of a scene's controller.

    In left support observations and actions are mirrored, so the policy is mirror symmetric.

    Attributes
    ----------
    scene
        Scene of the training, with its controller.
    layers
        Pairs of weight (out, in) and bias (out,), float32, with tanh between the layers.
    log_std
        Logarithm of the standard deviation of the exploration noise (joints,).
    mean, std
        Mean and standard deviation of the observations of the training (d,), for normalisation.
    clip
        Normalised observations are clipped to plus or minus this.
    action_scale
        Residual torque of a full action by joint [N m].
    observation_names, joint_names
        Names of observations and joints, as in `IceSkateEnv`.
    about
        Data of the training as JSON values: versions, seed, hyperparameters, results.
    seed
        Seed of the noise.

    Raises
    ------
    TypeError, ValueError
        If arrays, names and scene do not match or a number is out of range; the message names it.

    Examples
    --------
    >>> import skate_env
    >>> policy = skate_env.Policy.load(skate_env.policies.shipped("push_only"))
    >>> sim = skate_env.Simulator(policy.scene)
    >>> sim.step(policy.residual(sim))
    True
    """

    scene: Scene
    layers: Sequence[Layer]
    log_std: NDArray[np.float32]
    mean: Array
    std: Array
    clip: float
    action_scale: Mapping[str, float]
    observation_names: Sequence[str]
    joint_names: Sequence[str]
    about: Mapping[str, Any]
    seed: int = 0

    def __post_init__(self) -> None:
        names = self.observation_names, self.joint_names
        parts = checks.parts(self.scene, self.action_scale, *names, self.about)
        d, n = len(self.observation_names), len(self.joint_names)
        fields = parts | {
            "layers": checks.layers(self.layers, d, n),
            "log_std": checks.single("log_std", self.log_std, (n,), *_LOG_STD),
            "mean": checks.numbers("mean", self.mean, (d,), -checks.MOST, checks.MOST),
            "std": checks.numbers("std", self.std, (d,), _LEAST, checks.MOST),
            "clip": checks.scalar("clip", self.clip, _LEAST, checks.MOST),
            "seed": seed_of(self.seed),
        }
        for name, value in fields.items():
            object.__setattr__(self, name, value)

    def _actions(self, seen: Array, deterministic: bool) -> Single:
        """Return the actions, with noise unless ``deterministic``."""
        action = self._network(seen)
        if not deterministic:
            noise = self._random.standard_normal(action.shape, np.float32)
            action += np.exp(self.log_std) * noise
        return action.clip(-1.0, 1.0)

    def save(self, path: str | Path) -> None:
        """Write everything but the seed to one compressed ``.npz`` file.

        The file is replaced atomically.

        Raises
        ------
        ValueError
            If the layers have more than about four million numbers.
        OSError
            If the file cannot be written; one that exists is unchanged.
        """
        layers = {
            f"{name}{i}": array
            for i, layer in enumerate(self.layers)
            for name, array in zip(archive.LAYER, layer, strict=True)
        }
        arrays = {name: getattr(self, name) for name in ("log_std", "mean", "std", "clip")}
        self._write(path, archive.NETWORK, layers | arrays)

    @classmethod
    def load(cls, path: str | Path, seed: int = 0) -> "Policy":
        """Read a file of `save`; ``seed`` is the seed of the noise.

        Raises
        ------
        ValueError
            If the file is damaged, of an unknown format, or holds no policy.
        OSError
            If the file cannot be read.
        """
        seed_of(seed)
        return archive.load(Path(path), {archive.NETWORK: partial(cls, seed=seed)})

    @classmethod
    def from_sb3(
        cls,
        model: "OnPolicyAlgorithm",
        env: "VecEnv | gymnasium.Env[Any, Any]",
        normaliser: "VecNormalize | None" = None,
    ) -> "Policy":
        """Convert what Stable-Baselines3 has learned; its use needs neither that nor PyTorch.

        ::

            policy = Policy.from_sb3(model, env, normaliser)
            policy.save("policy.npz")  # skate-env replay --policy policy.npz

        Parameters
        ----------
        model
            PPO, A2C, or another algorithm with an ``MlpPolicy`` of actor and critic.
        env
            Environment of the policy, or a `VecEnv` of it, with the scene, the accuracy, the joints
            and the torques of a full action with which the policy is used. Limits of torques,
            rewards and perturbations do not become part of the policy.
        normaliser
            Statistics of the observations; None for those of ``env``, if it has any.

        Raises
        ------
        TypeError
            If ``model`` is no perceptron with tanh, or ``env`` no environment of this package.
        ValueError
            If ``env`` has ``mirrored=False``, or other joints than ``model`` has actions.
        """
        return cls(**from_sb3.fields(model, env, normaliser))

    @cached_property
    def _random(self) -> np.random.Generator:
        return np.random.default_rng(self.seed)

    def _network(self, seen: Array) -> NDArray[np.float32]:
        normal = np.clip((seen - self.mean) / self.std, -self.clip, self.clip)
        # Row by row: in a matrix product the rounding of a row depends on the number of rows.
        x = normal.astype(np.float32)[..., None, :]
        for i, (weight, bias) in enumerate(self.layers):
            x = x @ weight.T + bias
            if i < len(self.layers) - 1:
                x = np.tanh(x)
        return x[..., 0, :]
