"""Hyperparameters of the training, and their values by scene."""

from dataclasses import dataclass, replace


@dataclass(frozen=True)
class Hyperparameters:
    """All inputs of a training except scene and seed; the reward is that of the environment."""

    actions: int = 2_000_000
    """Total number of actions, over all environments."""
    period: float = 0.02
    """Duration of an action [s]. With 10 ms twice as many are needed."""
    envs: int = 64
    """Number of environments."""
    rollout: int = 64
    """Actions of each environment between two updates."""
    minibatch: int = 2048
    """Samples per gradient step."""
    epochs: int = 10
    """Epochs per update."""
    rate: float = 1e-3
    """Initial learning rate; it decreases linearly to a tenth."""
    gamma: float = 0.99
    """Discount per action: a horizon of 2 s, about four gait steps."""
    gae_lambda: float = 0.95
    """Parameter of generalised advantage estimation."""
    clip: float = 0.2
    """Clip range of PPO."""
    entropy: float = 0.003
    """Entropy coefficient; without it some seeds stop at two steps."""
    critic_updates: int = 0
    """Updates of the critic alone at the beginning, for a training that begins with a policy."""
    noise: float = 0.37
    """Initial standard deviation of actions, where 1 is a full action; it is learned."""
    layers: tuple[int, ...] = (64, 64)
    """Widths of the hidden layers of actor and critic, with tanh."""
    perturb: float = 0.02
    """Perturbation of every start, see `IceSkateEnv`."""
    trunk_noise: float = 0.01
    """Noise of the trunk's yaw and roll at every start, see `IceSkateEnv` [rad]."""
    kick: float = 0.3
    """Velocity change of random kicks, see `IceSkateEnv` [m/s]."""
    step: float = 0.001
    """Longest time step in the first part, with time-stepping [s]."""
    fine_from: float = 0.6
    """Fraction of the training at which the last part begins, with the accuracy of evaluations."""
    speed: float = 0.0
    """Weight of the reward's term `speed` [1/m]."""
    fine_flight: float = 40.0
    """Weight of the reward's term `flight` in the last part [1/s]. With the environment's own
    weight throughout, both feet are in the air for a tenth of the time."""
    average_from: float = 1.0
    """Fraction of the training from which on the policy is the mean of the weights."""
    episode: int = 1500
    """Time limit of episodes in the first part [actions]; short episodes give more starts."""
    fine_episode: int = 2000
    """Time limit of episodes in the last part [actions]; long episodes include late failures."""
    mirrored: bool = True
    """Whether states with left support are mirrored."""


# The controller of the paper already skates: small noise suffices.
_GAIT = Hyperparameters(
    actions=3_000_000,
    step=0.002,
    period=0.01,
    envs=128,
    gamma=0.995,
    entropy=0.0,
    noise=0.2,
    trunk_noise=0.0,
    kick=0.0,
    episode=3000,
    fine_episode=3000,
)
CONFIGS = {
    "paper": replace(_GAIT, actions=4_000_000, perturb=0.15),
    "paper_long_blade": replace(_GAIT, actions=4_000_000, perturb=0.15),
    "paper_damped": replace(_GAIT, fine_from=1.0, perturb=0.12),
}
"""Hyperparameters by scene, used by default; other scenes have the standard ones."""
