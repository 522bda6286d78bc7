"""Speed of PPO on IceSkate's environments and on environments that do nothing."""

from .environments import SCENES
from .peers import Unavailable, package
from .sizes import Sizes
from .table import Group, Row, measure

SIZES = ((64, 1024, "balanced"), (64, 64, "fast"), (64, 1024, "fast"), (512, 1024, "fast"))
"""Numbers of environments, minibatch sizes (64 in Stable-Baselines3) and accuracies."""
# Maximum number of gradient steps per epoch.
_GRADIENTS = 32
OWN, NULL = "IceSkateVecEnv", "null environments"


def case_of(n: int, minibatch: int, accuracy: str) -> str:
    """Return the name of a comparison with `n` environments and a minibatch size."""
    return f"PPO, {n} environments, minibatches of {minibatch}, `{accuracy}`"


def learner(sizes: Sizes) -> Group:
    """Measure updates of PPO (rollout and gradient steps) in one thread."""
    title, unit = "Learning", "one environment step of an update"
    try:
        torch = package("torch")
        package("stable_baselines3", "stable-baselines3")
    except Unavailable as error:
        rows = [Row(case_of(*size), NULL, "PPO", "", reason=str(error)) for size in SIZES]
        return Group(title, unit, 0, rows)
    from . import ppo

    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        updates = [
            update
            for n, minibatch, accuracy in SIZES
            for update in ppo.pair(
                n,
                accuracy,
                (case_of(n, minibatch, accuracy), OWN, NULL),
                min(sizes.rollout, _GRADIENTS * minibatch),
                minibatch,
            )
        ]
        group = measure(title, unit, [update.entry for update in updates], sizes.updates)
    finally:
        torch.set_num_threads(threads)
    group.rates = True
    for row, update in zip(group.rows, updates, strict=True):
        row.what += f"; rollouts are {update.share:.0%} of the time"
    group.notes = [
        "PPO of Stable-Baselines3, MlpPolicy 2 x 64, 10 epochs, on the CPU; torch and "
        f"environments in one thread. Scene {SCENES[0]}. Null environments return recorded "
        "observations.",
    ]
    return group
