"""Hyperparameters of the training, and their values by scene."""

from dataclasses import dataclass, field, replace

from .reward import Staged, Weights


@dataclass(frozen=True)
class Hyperparameters:
    """All inputs of a training except scene and seed."""

    actions: int = 5_000_000
    """Total number of actions of 10 ms, over all environments."""
    envs: int = 128
    """Number of environments."""
    rollout: int = 64
    """Actions of each environment between two updates."""
    minibatch: int = 2048
    """Samples per gradient step."""
    epochs: int = 10
    """Epochs per update."""
    rate: float = 1e-3
    """Initial learning rate; it decreases linearly to a tenth."""
    gamma: float = 0.995
    """Discount per action: a horizon of 2 s, about four gait steps."""
    gae_lambda: float = 0.95
    """Parameter of generalised advantage estimation."""
    clip: float = 0.2
    """Clip range of PPO."""
    noise: Staged = (0.35, 0.3, 0.2, 0.1)
    """Standard deviation of actions by stage, where 1 is a full action. A learned standard
    deviation becomes small before the policy slides."""
    entropy: float = 0.0
    """Entropy coefficient."""
    layers: tuple[int, ...] = (64, 64)
    """Widths of the hidden layers of actor and critic, with tanh."""
    warm_up: int = 100
    """Initial actions of each environment under the baseline, for the observation statistics."""
    critic_first: int = 50_000
    """Initial actions for which only the critic is trained."""
    first_until: float = 0.17
    """Fraction of the training at which the first stage of the reward ends."""
    last_from: float = 0.75
    """Fraction of the training at which the last stage of the reward begins."""
    leg_torque: float = 100.0
    """Residual torque of a full action in each leg joint [N m]."""
    trunk_torque: float = 100.0
    """The same in yaw, pitch and roll of the trunk [N m]."""
    neck_torque: float = 20.0
    """The same in the neck [N m]; arms have no residual."""
    perturb: float = 0.02
    """Perturbation of every start, see `IceSkateEnv`."""
    trunk_noise: float = 0.01
    """Noise of the trunk's yaw and roll at every start, see `IceSkateEnv` [rad]."""
    kick: float = 0.6
    """Velocity change of random kicks, see `IceSkateEnv` [m/s]."""
    step: float = 0.002
    """Longest time step in the first part, with time-stepping [s]. With the 5 ms of `fast` policies
    are in flight more often."""
    fine_from: float = 0.8
    """Fraction of the training at which the accuracy of evaluations begins."""
    episode: int = 1000
    """Time limit of episodes in the first part [actions]; short episodes give more starts."""
    fine_episode: int = 4000
    """Time limit of episodes in the last part [actions]; long episodes include late failures."""
    mirrored: bool = True
    """Whether states with left support are mirrored."""
    weights: Weights = field(default_factory=Weights)
    """Weights of the reward."""


# The baseline already skates: the noise is small, and the head term dominates. `alive` exceeds the
# head term; otherwise a fall increases the return.
_GAIT = Hyperparameters(
    noise=(0.2, 0.15, 0.05),
    trunk_noise=0.0,
    kick=0.0,
    first_until=0.1,
    last_from=0.7,
    episode=3000,
    fine_from=1.0,
)
_GAIT_WEIGHTS = Weights(alive=(20.0,), slide=(1.0,), flight=(1.0,), head=(25.0,), fall=(5.0,))
CONFIGS = {
    "paper": replace(
        _GAIT,
        actions=4_000_000,
        fine_from=0.6,
        fine_episode=3000,
        perturb=0.15,
        weights=replace(
            _GAIT_WEIGHTS,
            step=(5.0,),
            trunk=(2.0,),
            shortest_step=(0.8,),
            longest_step=(1.6,),
            long_slide=(1.0,),
        ),
    ),
    "paper_damped": replace(
        _GAIT,
        actions=3_000_000,
        perturb=0.12,
        weights=replace(_GAIT_WEIGHTS, step=(1.0,), shortest_step=(0.4,)),
    ),
    # First steps in any order, then the states in order, then a front foot that stays on the ice.
    "contact_sequence": Hyperparameters(
        actions=8_000_000,
        fine_from=0.8125,
        fine_episode=1500,
        leg_torque=150.0,
        kick=0.2,
        first_until=0.1,
        last_from=0.6,
        weights=Weights(
            slide=(1.0, 4.0, 4.0, 4.0),
            edge=(0.5, 0.2, 0.0, 0.0),
            fastest=(1.0,),
            long_slide=(0.4,),
            order=(5.0, 10.0, 20.0, 20.0, 30.0),
            dwell=(20.0, 60.0, 60.0, 60.0, 120.0),
            brake=(3.0, 10.0, 10.0, 10.0),
            close=(0.0, 20.0, 60.0, 100.0, 100.0),
            stray=(0.2, 4.0, 12.0, 16.0),
            hurry=(0.0, 1.0, 2.0, 2.0),
        ),
    ),
}
"""Hyperparameters by scene, used by default; `contact_sequence` is selected by name only."""
