"""The policy for any ice: ``python -m training.benchmark.any_ice --out out/any_ice``.

Six trainings, and a mean of five of them. About an hour of processor time. An interrupted
command goes on where it was when it is repeated. Needs the extra ``train``.
"""

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from numpy.typing import NDArray

from skate_env import Policy, load_scene
from skate_env.cli.options import fail, path
from skate_env.common import prepare_folder, write_text
from skate_env.environments import any_ice_scene
from skate_env.learning import ppo
from skate_env.learning.configs import Hyperparameters
from skate_env.learning.export import digest
from skate_env.learning.overrides import override
from skate_env.scenes import replace

from .several import SeveralTraining

# Forward friction coefficients of the scenes.
FRICTION = {
    "first": (0.03, 0.42),
    "all": (0.035, 0.44),
    "smooth": (0.035, 0.07),
    "rough": (0.3, 0.44),
}
# Hyperparameters that differ from the standard ones: of every training, and of all but the first.
EVERY = {"perturb": 0.05, "trunk_noise": 0.02, "kick": 1.0, "high_speed": 2.5}
LATER = EVERY | {
    "fine_from": 0.0,
    "rollout": 128,
    "minibatch": 4096,
    "epochs": 8,
    "noise": 0.12,
    "critic_updates": 30,
    "average_from": 0.3,
    "fine_flight": 8.0,
}


@dataclass(frozen=True)
class Part:
    """A training that begins with the mean of others, or from scratch."""

    name: str
    begins_with: Sequence[str]
    scenes: Sequence[str]
    seed: int
    numbers: Mapping[str, Any]


_SCRATCH = EVERY | {
    "actions": 12_000_000,
    "step": 0.002,
    "fine_from": 0.7,
    "episode": 600,
    "fine_episode": 2500,
}
_ALIKE, _MORE_SMOOTH = ("all", "smooth", "rough"), ("all", "smooth", "smooth", "rough")
_STARTS = LATER | {"actions": 2_000_000, "rate": 2e-4, "fine_episode": 200}
_LONG = LATER | {"actions": 3_500_000, "rate": 3e-4, "fine_episode": 2500}
PARTS = (
    Part("scratch", (), ("first",), 2, _SCRATCH),
    Part("long", ("scratch",), _ALIKE, 1, _LONG),
    Part("longer", ("long",), _ALIKE, 4, _LONG | {"actions": 2_500_000, "fine_flight": 10.0}),
    Part("medium", ("scratch",), _ALIKE, 1, _LONG | {"fine_episode": 600}),
    Part("short", ("long",), _MORE_SMOOTH, 1, _STARTS),
    Part("starts", ("long", "longer", "medium"), _MORE_SMOOTH, 1, _STARTS),
)
# How often each training counts in the mean.
MEAN = {"long": 7, "longer": 7, "medium": 4, "short": 3, "starts": 27}


def mean_of(policies: Sequence[Policy], counts: Sequence[int] | None = None) -> Policy:
    """Return the policy whose weights are the mean of those of several trainings.

    They must have begun with the same policy: then the mean is often better than each (Wortsman et
    al. 2022, "Model soups"). First layers are averaged as functions of the observations before
    normalisation. Scene, noise and normalisation are those of the first policy. `counts` is how
    often each policy counts; by default once.

    Raises
    ------
    ValueError
        If there is no policy, if observations, joints, scales or layers differ, or if `counts`
        does not have one positive number for each policy.
    """
    if not policies:
        raise ValueError("the mean needs at least one policy")
    counts = [1] * len(policies) if counts is None else list(counts)
    if len(counts) != len(policies) or min(counts) < 1:
        raise ValueError(f"counts = {counts}: must be one number >= 1 for each policy")
    first = policies[0]
    for policy in policies[1:]:
        for name in ("observation_names", "joint_names", "action_scale", "clip"):
            if getattr(policy, name) != getattr(first, name):
                raise ValueError(f"the mean of policies: their {name} differ")
        if [w.shape for w, _ in policy.layers] != [w.shape for w, _ in first.layers]:
            raise ValueError("the mean of policies: their layers differ")
    shares, layers = [count / sum(counts) for count in counts], []
    for i in range(len(first.layers)):
        weights: list[NDArray[np.floating]] = []
        biases: list[NDArray[np.floating]] = []
        for policy, share in zip(policies, shares, strict=True):
            weight, bias = policy.layers[i]
            if i == 0:
                raw = weight / policy.std
                weights.append(share * (raw * first.std))
                biases.append(share * (bias - raw @ policy.mean + raw @ first.mean))
            else:
                weights.append(share * weight)
                biases.append(share * bias)
        layer = np.sum(weights, axis=0), np.sum(biases, axis=0)
        layers.append((layer[0].astype(np.float32), layer[1].astype(np.float32)))
    about = {"mean_of": [digest(policy) for policy in policies], "counts": counts}
    return dataclasses.replace(first, layers=layers, about=about)


def mean(out: Path, counts: Mapping[str, int]) -> Policy:
    """Return the mean of finished trainings, by name, each as often as it counts."""
    policies = [Policy.load(out / name / ppo.POLICY) for name in counts]
    return mean_of(policies, list(counts.values()))


def train(out: Path, part: Part) -> None:
    """Train a part, unless its policy exists; resume it from its checkpoint, if there is one."""
    folder = out / part.name
    if (folder / ppo.POLICY).exists():
        return
    if (folder / ppo.CHECKPOINT).exists():
        ppo.resume(folder)
        return
    # The policy itself, where it is only one: its mean is rounded.
    first = out / part.begins_with[0] / ppo.POLICY if part.begins_with else None
    if len(part.begins_with) > 1:
        first = folder / "first.npz"
        prepare_folder(folder)
        mean(out, dict.fromkeys(part.begins_with, 1)).save(first)
    numbers = override(Hyperparameters(), part.numbers.items())
    period = {"control.action_period": numbers.period}
    scene, *others = (replace(out / f"{name}.toml", period) for name in part.scenes)
    about = {"scene": ", ".join(part.scenes)}
    training = SeveralTraining(scene, part.seed, numbers, 1, about, tuple(others))
    ppo.start(training, folder, first)


def build(out: Path, parts: Sequence[Part] = PARTS) -> Policy:
    """Train all parts and write their `MEAN` to ``OUT/policy.npz``."""
    for name, friction in FRICTION.items():
        drawn = {"randomise": {"ice.friction.mu_forward": list(friction)}}
        scene = any_ice_scene(replace(load_scene("push_only"), drawn))
        write_text(out / f"{name}.toml", scene.to_toml())
    for part in parts:
        typer.echo(f"{'training':<12}{part.name}")
        train(out, part)
        typer.echo(f"{'SHA-256':<12}{digest(Policy.load(out / part.name / ppo.POLICY))}")
    policy = mean(out, MEAN)
    # The scene of the task, whatever the ranges in training.
    period = {"control.action_period": Hyperparameters().period}
    policy = policy.on(replace(any_ice_scene(), period))
    policy.save(out / ppo.POLICY)
    return policy


def main(
    out: Annotated[Path, typer.Option(parser=path, help="Folder of the trainings and the policy.")],
) -> None:
    """Train the policy for any ice."""
    try:
        prepare_folder(out)
        policy = build(out)
    except (ValueError, OSError) as error:
        fail(error)
    typer.echo(f"{'policy':<12}{out / ppo.POLICY}")
    typer.echo(f"{'SHA-256':<12}{digest(policy)}")


if __name__ == "__main__":
    typer.run(main)
