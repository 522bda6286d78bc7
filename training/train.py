"""Train residual torques with PPO: ``python -m training.train --scene unilateral --out out/seed1``.

PPO (Schulman et al. 2017, arXiv:1707.06347) of Stable-Baselines3, on one core. The first policy is
the baseline: its last layer is zero, so it adds nothing but noise; normaliser and critic get to
know the baseline before the policy moves. The reward is tightened in stages (`training.reward`).
One seed gives one policy, to the bit, on one machine, however often the training is stopped and
resumed.
"""

import time
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import torch
import typer
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.logger import configure
from stable_baselines3.common.vec_env import VecNormalize
from tqdm import tqdm

from skate_env import Scene, load_scene
from skate_env.arguments import known
from skate_env.options import SceneOption, WithoutOption, fail

from . import checkpoint
from .artefact import digest, policy_of
from .changes import changed
from .course import Course, environments
from .recipes import RECIPES, Hyperparameters
from .reward import at
from .trial import FIRST_START

LEGS = ("q2", "q3", "q4", "q5", "q6", "q7")
TRUNK = ("q8", "q9", "q10")
CHECKPOINT, POLICY = "checkpoint.pkl", "policy.npz"
# Where policies are judged.
FINE = "balanced"
# Environment i has the seed's i-th successor: none is a start of the evaluation.
MOST_SEED = FIRST_START // 2
# [s]
CHECKPOINT_PERIOD = 60.0
# What a checkpoint has of its own.
OPTIONS = ("scene", "recipe", "seed", "set_", "without", "threads")
FIXED = {name: f"--{name.strip('_')}" for name in OPTIONS}


def course_of(scene: Scene, numbers: Hyperparameters, threads: int) -> Course:
    """Make the environments of a training."""
    torques = dict.fromkeys(LEGS, numbers.leg_torque) | dict.fromkeys(TRUNK, numbers.trunk_torque)
    torques["q17"] = numbers.neck_torque
    return Course(
        numbers.envs,
        scene,
        torques,
        numbers.weights,
        mirrored=numbers.mirrored,
        max_episode_steps=numbers.episode,
        accuracy={"method": "moreau", "step": numbers.step},
        perturb=numbers.perturb,
        trunk_noise=numbers.trunk_noise,
        kick=numbers.kick,
        num_threads=threads,
    )


def begin(scene: Scene, seed: int, numbers: Hyperparameters, threads: int = 1) -> PPO:
    """Make a learner whose policy is the baseline, and whose normaliser knows it."""
    course = course_of(scene, numbers, threads)
    # A number that hardly ever changes, such as a rare contact state, is not blown up.
    venv = VecNormalize(course, gamma=numbers.gamma, epsilon=1e-2)
    model = PPO(
        "MlpPolicy",
        venv,
        n_steps=numbers.rollout,
        batch_size=numbers.minibatch,
        n_epochs=numbers.epochs,
        learning_rate=lambda left: numbers.rate * (0.1 + 0.9 * left),
        gamma=numbers.gamma,
        gae_lambda=numbers.gae_lambda,
        clip_range=numbers.clip,
        ent_coef=numbers.entropy,
        seed=seed,
        device="cpu",
        policy_kwargs={
            "net_arch": list(numbers.layers),
            "activation_fn": torch.nn.Tanh,
            "optimizer_kwargs": {"eps": 1e-5, "fused": True},
        },
    )
    policy: Any = model.policy
    torch.nn.init.zeros_(policy.action_net.weight)
    venv.reset()
    nothing = np.zeros((numbers.envs, len(course.joints)), np.float32)
    for _ in range(numbers.warm_up):
        venv.step(nothing)
    return model


class Stages(BaseCallback):
    """Moves the course on, holds the actor still at first, says how it goes, saves checkpoints."""

    def __init__(self, model: PPO, about: dict[str, Any], folder: Path, bar: "tqdm[Any]") -> None:
        super().__init__()
        self._learner = model
        _, _, self._course = environments(model)
        self._numbers: Hyperparameters = about["hyperparameters"]
        self._about, self._folder, self._bar = about, folder, bar
        self._saved = time.monotonic()

    def _on_rollout_start(self) -> None:
        if time.monotonic() - self._saved > CHECKPOINT_PERIOD:
            checkpoint.save(self._learner, self._folder / CHECKPOINT, self._about)
            self._saved = time.monotonic()
        parts = self._numbers.first_until, self._numbers.last_from
        done = self.num_timesteps / self._numbers.actions
        if done >= self._numbers.fine_from and self._course.accuracy != FINE:
            self._go_fine()
        progress = self._course.progress = float(np.interp(done, parts, (0.0, 1.0)))
        policy: Any = self._learner.policy
        for part in (policy.mlp_extractor.policy_net, policy.action_net):
            part.requires_grad_(self.num_timesteps >= self._numbers.critic_first)
        policy.log_std.requires_grad_(False).fill_(np.log(at(progress, self._numbers.noise)))

    def _go_fine(self) -> None:
        """Begin all episodes anew, long ones on the finer engine."""
        normaliser, _, course = environments(self._learner)
        self._course = course.under(FINE, self._numbers.fine_episode)
        normaliser.venv = self._course
        self._course.seed(self._learner.seed)
        # What collecting a rollout begins with.
        self._learner._last_obs = normaliser.reset()
        self._learner._last_episode_starts = np.ones(course.num_envs, np.bool_)

    def _on_step(self) -> bool:
        self._bar.update(self._numbers.envs)
        return True

    def _on_rollout_end(self) -> None:
        course = self._course
        actions = self._numbers.envs * self._numbers.rollout
        seconds = course.batch.action_period * actions
        for name, value in course.terms.items():
            self.logger.record(f"reward/{name}_per_s", value / seconds)
        self.logger.record("course/progress", course.progress)
        if course.episodes:
            lasted, steps, flight, double, slide = np.mean(course.episodes, axis=0)
            told = {
                "lasted_s": lasted,
                "steps": steps,
                "period_s": lasted / max(steps, 1.0),
                "loaded_slide_per_step_m": slide / max(steps, 1.0),
                "flight_share": flight / lasted,
                "double_support_share": double / lasted,
            }
            for name, value in told.items():
                self.logger.record(f"episode/{name}", value)
            self._bar.set_postfix_str(f"{steps:.1f} steps in {lasted:.1f} s")
        course.terms.clear()
        course.episodes.clear()


def learn(model: PPO, about: dict[str, Any], folder: Path) -> None:
    """Go on to the last action, with a progress bar on stderr."""
    numbers: Hyperparameters = about["hyperparameters"]
    model.set_logger(configure(str(folder), ["tensorboard"]))
    left = numbers.actions - model.num_timesteps
    with tqdm(
        total=numbers.actions, initial=model.num_timesteps, unit="action", unit_scale=True
    ) as bar:
        model.learn(left, callback=Stages(model, about, folder, bar), reset_num_timesteps=False)


def main(
    ctx: typer.Context,
    out: Annotated[Path, typer.Option(help="Folder of policy, checkpoint and curves.")],
    scene: SceneOption = "unilateral",
    recipe: Annotated[
        str | None,
        typer.Option(
            metavar="NAME", help=f"{', '.join(RECIPES)}; the scene's own, or the standard, if not."
        ),
    ] = None,
    seed: Annotated[int, typer.Option(min=0, max=MOST_SEED, help="Of everything random.")] = 1,
    set_: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="NAME=VALUE", help="A hyperparameter; may be repeated."),
    ] = None,
    resume: Annotated[bool, typer.Option("--resume", help="Go on from OUT's checkpoint.")] = False,
    without: WithoutOption = None,
    threads: Annotated[int, typer.Option(min=1, help="Of the environments; PyTorch has one.")] = 1,
) -> None:
    """Train residual torques with PPO; see training/README.md for what comes of it.

    \b
    On ice that only pushes:
      python -m training.train --scene unilateral --seed 1 --out out/unilateral/1
    Curves, every term of the reward among them:
      tensorboard --logdir out
    Go on where it was stopped; the same policy comes of it:
      python -m training.train --out out/unilateral/1 --resume
    What it learns where nothing but the residual acts:
      python -m training.train --without feedforward --without visual_lifting --out out/scratch/1
    Towards the paper's order of contact states there:
      python -m training.train --recipe order --out out/order/1
    Other hyperparameters than those in training/recipes.py:
      python -m training.train --set actions=300000 --set weights.flight=[1,4] --out out/try

    The folder receives policy.npz (skate_env.Policy.load reads it), checkpoint.pkl and
    TensorBoard's events.
    """  # noqa: D301 (\b keeps the examples' line breaks)
    torch.set_num_threads(1)
    try:
        if resume:
            sources = {flag: ctx.get_parameter_source(name) for name, flag in FIXED.items()}
            given = [flag for flag, of in sources.items() if of and of.name == "COMMANDLINE"]
            if given:
                raise ValueError(f"{', '.join(given)}: --resume goes on with the checkpoint's own")
            model, about = checkpoint.load(out / CHECKPOINT)
        else:
            skated = load_scene(scene)
            known("recipe", [recipe] if recipe else [], RECIPES)
            numbers = RECIPES.get(recipe or skated.name, Hyperparameters())
            numbers = changed(numbers, set_ or [])
            for effect in without or []:
                skated = skated.without(effect)
            model = begin(skated, seed, numbers, threads)
            about = {"scene": scene, "without": without or [], "seed": seed}
            about["hyperparameters"] = numbers
        out.mkdir(parents=True, exist_ok=True)
        learn(model, about, out)
        checkpoint.save(model, out / CHECKPOINT, about)
        told = about | {"hyperparameters": asdict(about["hyperparameters"])}
        policy = policy_of(model, told)
        policy.save(out / POLICY)
    except (ValueError, OSError) as error:
        fail(error)
    typer.echo(f"{'policy':<12}{out / POLICY}")
    typer.echo(f"{'fingerprint':<12}{digest(policy)}")


app = typer.Typer(add_completion=False, pretty_exceptions_enable=False, rich_markup_mode=None)
app.command()(main)

if __name__ == "__main__":
    app()
