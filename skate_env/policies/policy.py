"""A learned policy in one file, which is used without the library that trained it.

It consists of a normaliser, a multilayer perceptron and a torque scale::

    policy = skate_env.Policy.load("policy.npz")
    env = gymnasium.make("IceSkate-v0", **policy.environment())
    observation, info = env.reset(seed=0)
    action, _ = policy.predict(observation)
"""

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._core import Scene, Simulator
from ..common import seed_of
from ..environments import Observation
from ..scenes import Mirror, as_scene
from . import archive, checks
from .checks import Array, Layer

_FOLDER = Path(str(resources.files(__package__)))


@dataclass(frozen=True, eq=False)
class Policy:
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
            "log_std": checks.log_std(self.log_std, n),
            "mean": checks.mean(self.mean, d),
            "std": checks.std(self.std, d),
            "clip": checks.clip(self.clip),
            "seed": seed_of(self.seed),
        }
        for name, value in fields.items():
            object.__setattr__(self, name, value)

    def predict(
        self,
        observation: Observation,
        state: Any = None,
        episode_start: Any = None,
        deterministic: bool = True,
    ) -> tuple[Observation, Any]:
        """Return actions for one observation (d,) or many (n, d), and the state unchanged.

        Arguments and results are those of `predict` in Stable-Baselines3. Each action depends on
        its own observation only, bit for bit; with ``deterministic=False`` noise is added.

        Raises
        ------
        TypeError, ValueError
            If the observation does not consist of finite numbers, or has another shape.
        """
        seen = checks.observations(observation, len(self.observation_names))
        mirror, mirror_action = self._mirrors
        left = seen[..., self._leg, None] < 0.0
        action = self._network(np.where(left, mirror(seen), seen))
        if not deterministic:
            noise = self._random.standard_normal(action.shape, np.float32)
            action += np.exp(self.log_std) * noise
        action = action.clip(-1.0, 1.0)
        return np.where(left, mirror_action(action), action), state

    def residual(self, sim: Simulator) -> Array:
        """Return the residual torques (joints,) [N m] for a simulator's next action period."""
        action, _ = self.predict(sim.observation())
        return np.array(list(self.action_scale.values())) * action

    def environment(self) -> dict[str, Any]:
        """Return the keywords of `gymnasium.make("IceSkate-v0")` of its environment."""
        return checks.environment(self.scene, self.action_scale)

    def on(self, scene: Scene | str | Path) -> "Policy":
        """Copy the policy for another scene: a `Scene`, a preset's name, or a file's path.

        Raises
        ------
        ValueError
            If the scene has other joints or observations.
        """
        return dataclasses.replace(self, scene=as_scene(scene))

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
        scale = {"action_scale": list(self.action_scale.values())}
        text = {
            "scene": self.scene.to_toml(),
            "observation_names": self.observation_names,
            "joint_names": self.joint_names,
            "about": self.about,
        }
        archive.write(Path(path), layers | arrays | scale, text)

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
        fields = archive.read(Path(path))
        try:
            torques = fields["action_scale"].tolist()
            fields["action_scale"] = dict(zip(fields["joint_names"], torques, strict=True))
            return cls(**fields, seed=seed)
        except (TypeError, ValueError) as error:
            raise ValueError(f"policy {path}: {error}") from None

    @cached_property
    def _mirrors(self) -> tuple[Mirror, Mirror]:
        return Mirror(self.observation_names), Mirror(self.joint_names)

    @cached_property
    def _leg(self) -> int:
        return list(self.observation_names).index("support_leg")

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


def shipped(scene: str) -> Path:
    """Return the path of the shipped policy of a preset, or of ``any_ice``.

    Raises
    ------
    ValueError
        If there is none; the message names those that exist.
    """
    names = sorted(path.stem for path in _FOLDER.glob("*.npz"))
    if scene not in names:
        known = f"there is one for {', '.join(names)}"
        raise ValueError(f"no policy for the scene {scene!r} comes with the package: {known}")
    return _FOLDER / f"{scene}.npz"
