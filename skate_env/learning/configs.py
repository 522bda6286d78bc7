"""Hyperparameters of the training, and their values by scene."""

from dataclasses import dataclass, field, replace

from .reward import Staged, Weights


@dataclass(frozen=True)
class Hyperparameters:
    """Everything beside scene and seed that determines a training."""

    actions: int = 5_000_000
    """Actions of 10 ms to learn from, all environments together."""
    envs: int = 128
    """Environments side by side: more give more varied, shorter rollouts."""
    rollout: int = 64
    """Actions of each between two updates."""
    minibatch: int = 2048
    """Samples of a gradient step; small networks want large ones, for speed."""
    epochs: int = 10
    """How often an update goes through its samples."""
    rate: float = 1e-3
    """Learning rate at first; it falls to a tenth, in a straight line."""
    gamma: float = 0.995
    """Discount: 2 s ahead, some four steps."""
    gae_lambda: float = 0.95
    """Bias against variance of the advantage."""
    clip: float = 0.2
    """How far an update may move a probability."""
    noise: Staged = (0.35, 0.3, 0.2, 0.1)
    """Standard deviation of actions, as a part of a full one, stage by stage. Left to itself it
    shrinks before the policy has found out how to slide."""
    entropy: float = 0.0
    """Bonus for noise."""
    layers: tuple[int, ...] = (64, 64)
    """Width of actor's and critic's layers, tanh between them."""
    warm_up: int = 100
    """Actions of each environment under the baseline alone, for the normaliser."""
    critic_first: int = 50_000
    """Actions for which only the critic is trained."""
    first_until: float = 0.17
    """Part of the training after which the reward is tightened, from its first stage on."""
    last_from: float = 0.75
    """Part of the training after which it stays at its last stage."""
    leg_torque: float = 100.0
    """Residual of a full action in each joint of the legs [N m]."""
    trunk_torque: float = 100.0
    """In yaw, pitch and roll of the trunk [N m]."""
    neck_torque: float = 20.0
    """In the neck [N m]; arms get none."""
    perturb: float = 0.02
    """Disturbance of every start: `IceSkateEnv`."""
    trunk_noise: float = 0.01
    """Of the trunk's yaw and roll at every start, likewise [rad]."""
    kick: float = 0.6
    """Change of velocity every few seconds, likewise [m/s]."""
    step: float = 0.002
    """Of the engine at first, time-stepping: the longest of them [s]. With the 5 ms of `fast` a
    policy is in the air more often."""
    fine_from: float = 0.8
    """Part of the training after which the engine is as accurate as where policies are judged."""
    episode: int = 1000
    """Actions after which an episode is cut: short ones show more starts."""
    fine_episode: int = 4000
    """Episode length in the fine part [actions]; long episodes show late consequences."""
    mirrored: bool = True
    """Whether states with left support are mirrored."""
    weights: Weights = field(default_factory=Weights)
    """Of the reward."""


# The paper's own gait is there already: less noise, and it is the head that pays. To be on the feet
# has to be worth more than the head costs, or it pays to fall.
_GAIT = Hyperparameters(
    noise=(0.2, 0.15, 0.05),
    trunk_noise=0.0,
    kick=0.0,
    first_until=0.1,
    last_from=0.7,
    episode=3000,
    fine_from=1.0,
)
_GAIT_PAYS = Weights(alive=(20.0,), slide=(1.0,), flight=(1.0,), head=(25.0,), fall=(5.0,))
CONFIGS = {
    "paper": replace(
        _GAIT,
        actions=4_000_000,
        fine_from=0.6,
        fine_episode=3000,
        perturb=0.15,
        weights=replace(
            _GAIT_PAYS,
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
        weights=replace(_GAIT_PAYS, step=(1.0,), shortest_step=(0.4,)),
    ),
    # Steps first, in any order; then state by state; at last the front foot has to stay down.
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
"""By the name of a scene, which takes it by default; `contact_sequence` is chosen by name only."""
