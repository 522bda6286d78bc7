"""Learning on our environments, against learning on environments that cost nothing."""

from .environments import SCENES
from .peers import Missing, package
from .sizes import Extent
from .table import Group, Row, measure

SIZES = ((64, 64), (64, 1024), (512, 1024))
"""Numbers of environments and lengths of minibatches; Stable-Baselines3's own have 64 steps."""
# Gradient steps an epoch, at most.
_GRADIENTS = 32
OWN, FREE = "IceSkateVecEnv", "free environments"


def case_of(n: int, minibatch: int) -> str:
    """Name the comparison with so many environments and such minibatches."""
    return f"PPO, {n} environments, minibatches of {minibatch}"


def learner(extent: Extent) -> Group:
    """Measure updates of PPO, rollout and gradient steps, in one thread."""
    title, unit = "Learning", "one environment step of an update"
    try:
        torch = package("torch")
        package("stable_baselines3", "stable-baselines3")
    except Missing as missing:
        rows = [Row(case_of(*size), FREE, "PPO", "", reason=str(missing)) for size in SIZES]
        return Group(title, unit, 0, rows)
    from . import ppo

    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        updates = [
            update
            for n, minibatch in SIZES
            for update in ppo.pair(
                n,
                (case_of(n, minibatch), OWN, FREE),
                min(extent.rollout, _GRADIENTS * minibatch),
                minibatch,
            )
        ]
        group = measure(title, unit, [update.entry for update in updates], extent.updates)
    finally:
        torch.set_num_threads(threads)
    group.rates = True
    for row, update in zip(group.rows, updates, strict=True):
        row.what += f"; rollouts are {update.share:.0%} of the time"
    group.notes = [
        "PPO of Stable-Baselines3, MlpPolicy 2 x 64, 10 epochs, on the CPU; torch and "
        f"environments in one thread. Scene {SCENES[0]}, accuracy `fast`. Free environments give "
        "observations that were recorded before.",
    ]
    return group
