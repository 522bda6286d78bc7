"""Hyperparameters of the training, and their values by scene."""

from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Annotated

from .overrides import Range, check

# Limits on the observations of an update and on the weights between the hidden layers: the former
# fit into memory, the latter into the file of a policy.
_MOST_SAMPLES, _MOST_WEIGHTS = 10_000_000, 3_000_000


def check_sizes(minibatch: int, envs: int, rollout: int, layers: tuple[int, ...]) -> None:
    """Check the sizes of an update, and that a policy's file holds the layers; raise ValueError."""
    samples = envs * rollout
    if samples > _MOST_SAMPLES:
        raise ValueError(f"envs * rollout = {samples}: must be at most {_MOST_SAMPLES}")
    if minibatch > samples:
        raise ValueError(f"minibatch = {minibatch}: must be at most envs * rollout = {samples}")
    weights = sum(a * b for a, b in pairwise(layers))
    if weights > _MOST_WEIGHTS:
        raise ValueError(
            f"layers = {list(layers)}: {weights} weights between them, must be at most "
            f"{_MOST_WEIGHTS}"
        )


@dataclass(frozen=True)
class Hyperparameters:
    """All inputs of a training except scene and seed; the reward is that of the environment.

    Raises
    ------
    TypeError, ValueError
        If a number has another type, is out of its range, or does not fit the others.
    """

    actions: Annotated[int, Range(1, 10**12)] = 2_000_000
    """Total number of actions, over all environments."""
    period: Annotated[float, Range(1e-4, 1.0)] = 0.02
    """Duration of an action [s]. With 10 ms twice as many are needed."""
    envs: Annotated[int, Range(1, 100_000)] = 64
    """Number of environments."""
    rollout: Annotated[int, Range(1, 100_000)] = 64
    """Actions of each environment between two updates."""
    minibatch: Annotated[int, Range(2, 10_000_000)] = 2048
    """Samples per gradient step."""
    epochs: Annotated[int, Range(1, 1000)] = 10
    """Epochs per update."""
    rate: Annotated[float, Range(0.0, 1.0)] = 1e-3
    """Initial learning rate; it decreases linearly to a tenth."""
    gamma: Annotated[float, Range(0.0, 1.0)] = 0.99
    """Discount per action: a horizon of 2 s, about four gait steps."""
    gae_lambda: Annotated[float, Range(0.0, 1.0)] = 0.95
    """Parameter of generalised advantage estimation."""
    clip: Annotated[float, Range(1e-3, 10.0)] = 0.2
    """Clip range of PPO."""
    entropy: Annotated[float, Range(0.0, 1.0)] = 0.0
    """Entropy coefficient."""
    critic_updates: Annotated[int, Range(0, 1_000_000)] = 0
    """Updates of the critic alone at the beginning, for a training that begins with a policy."""
    noise: Annotated[float, Range(1e-3, 10.0)] = 0.6
    """Initial standard deviation of actions, where 1 is a full action; it is learned. With 0.37
    one of four trainings steps in place."""
    layers: Annotated[tuple[int, ...], Range(1, 4096)] = (64, 64)
    """Widths of the hidden layers of actor and critic, with tanh."""
    perturb: Annotated[float, Range(0.0, 10.0)] = 0.02
    """Perturbation of every start, see `IceSkateEnv`."""
    trunk_noise: Annotated[float, Range(0.0, 1.0)] = 0.01
    """Noise of the trunk's yaw and roll at every start, see `IceSkateEnv` [rad]."""
    kick: Annotated[float, Range(0.0, 10.0)] = 0.3
    """Velocity change of random kicks, see `IceSkateEnv` [m/s]."""
    step: Annotated[float, Range(1e-6, 0.1)] = 0.001
    """Longest time step in the first part, with time-stepping [s]."""
    fine_from: Annotated[float, Range(0.0, 1.0)] = 0.6
    """Fraction of the training at which the last part begins, with the accuracy of evaluations."""
    high_speed: Annotated[float, Range(0.0, 1e6)] = 5.0
    """Limit of the reward's term `speed` [m/s]."""
    fine_flight: Annotated[float, Range(-1e6, 1e6)] = 4.0
    """Weight of the reward's term `flight` in the last part [1/s]. With the environment's own
    weight throughout, both feet are in the air for 10 to 27 % of the time."""
    average_from: Annotated[float, Range(0.0, 1.0)] = 1.0
    """Fraction of the training from which on the policy is the mean of the weights."""
    episode: Annotated[int, Range(1, 1_000_000)] = 1500
    """Time limit of episodes in the first part [actions]; short episodes give more starts."""
    fine_episode: Annotated[int, Range(1, 1_000_000)] = 2000
    """Time limit of episodes in the last part [actions]; long episodes include late failures."""

    def __post_init__(self) -> None:
        check(self)
        check_sizes(self.minibatch, self.envs, self.rollout, self.layers)


# The controller of the paper already skates: small noise suffices.
_GAIT = Hyperparameters(
    actions=3_000_000,
    step=0.002,
    period=0.01,
    envs=128,
    gamma=0.995,
    noise=0.2,
    trunk_noise=0.0,
    kick=0.0,
    episode=3000,
    fine_episode=3000,
)
CONFIGS = {
    "paper": replace(_GAIT, actions=4_000_000, perturb=0.15),
    "paper_printed": replace(_GAIT, actions=4_000_000, perturb=0.15),
}
"""Hyperparameters by scene, used by default; other scenes have the standard ones."""
