"""Make everything in the repository that a program makes, in the order of what needs what.

Policies, presets, closed steps, results of learners, measured pages, pictures and films; where
there is chance, with a seed. ``out/artefacts`` remembers what was made, so an interrupted command
goes on where it was. `git diff` then shows what differs from what was committed.

The policies of the package were trained with earlier rewards: their commands give others now.
"""

import subprocess
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

ROOT = Path(__file__).parents[1]
OUT = "out/artefacts"
_PYTHON, _SKATE, _GENERATED = ".venv/bin/python", ".venv/bin/skate-env", "docs/generated"
app = typer.Typer()


@dataclass(frozen=True)
class Artefact:
    """Files of the repository that are made together.

    Attributes
    ----------
    minutes
        Processor time on one core, measured once; None if not measured.
    files
        Patterns of the files, relative to the root of the repository.
    commands
        Lines of a shell that write them, run from the root.
    """

    minutes: float | None
    files: tuple[str, ...]
    commands: tuple[str, ...]


def _policy(scene: str, seed: int, minutes: float | None) -> Artefact:
    """Train a policy of the package; an interrupted training goes on from its checkpoint."""
    out, file = f"{OUT}/{scene}", f"skate_env/policies/{scene}.npz"
    train = f"{_SKATE} train --scene {scene} --seed {seed} --out {out}"
    go_on = f"{_SKATE} train --resume --out {out}"
    choice = f"if [ -e {out}/checkpoint.pkl ]; then {go_on}; else {train}; fi"
    return Artefact(minutes, (file,), (choice, f"cp {out}/policy.npz {file}"))


def _target(name: str, *files: str) -> Artefact:
    """Run a target of the Makefile."""
    return Artefact(None, files, (f"make {name}",))


ARTEFACTS = {
    "preset": Artefact(
        8,
        ("skate_env/scenes/paper.toml",),
        (
            f"{_PYTHON} -m training.gaits.search --scene training/gaits/starts/human_foot.toml "
            "--freeze start --budget 800 --final 1 --steps 30 --settle 20 --sigma 0.01 "
            f"--episodes 2 --spread 0.2 --seed 1 --out {OUT}/paper.toml",
            # The preset has comments; it must be the same scene.
            f"{_PYTHON} -c 'import skate_env as s; "
            f'assert s.load_scene("{OUT}/paper.toml") == s.load_scene("paper")\'',
        ),
    ),
    "step": Artefact(
        25,
        ("training/orbits/push_only.npz", "docs/push-only-orbit.png"),
        (
            f"{_PYTHON} -m training.trajectory --out {OUT}/step",
            f"cp {OUT}/step/push_only.npz training/orbits",
            f"{_PYTHON} -m training.orbits.push_only --picture docs/push-only-orbit.png",
        ),
    ),
    "paper": _policy("paper", 2, 5),
    "paper_printed": _policy("paper_printed", 4, None),
    "push_only": _policy("push_only", 1, 4),
    "any_ice": Artefact(
        60,
        ("skate_env/policies/any_ice.npz",),
        (
            f"{_PYTHON} -m training.benchmark.any_ice --out {OUT}/any_ice",
            f"cp {OUT}/any_ice/policy.npz skate_env/policies/any_ice.npz",
        ),
    ),
    "benchmark": Artefact(
        None,
        ("training/benchmark/results/*/*/*.json", f"{_GENERATED}/benchmark.*"),
        (
            f"{_PYTHON} -m training.benchmark all --out {OUT}/results",
            f"cp -r {OUT}/results training/benchmark",
            f"{_PYTHON} -m training.benchmark report --out {OUT}/benchmark",
            f"cp {OUT}/benchmark/benchmark.* {_GENERATED}",
        ),
    ),
    "figures": Artefact(
        2,
        (f"{_GENERATED}/one-step.png", f"{_GENERATED}/arms-with-tau8.png", "docs/orbits.png"),
        (
            f"{_SKATE} replay --scene paper --out {OUT}/replay",
            f"cp {OUT}/replay/fig05_screenshots.png {_GENERATED}/one-step.png",
            f"{_SKATE} replay --scene paper_arms --torque tau8 --out {OUT}/arms",
            f"cp {OUT}/arms/fig10_arms_with_tau8.png {_GENERATED}/arms-with-tau8.png",
            f"{_PYTHON} -m training.orbits --scene paper --out {OUT}/orbit",
            f"cp {OUT}/orbit/orbit.png docs/orbits.png",
        ),
    ),
    "gaits": _target("gaits", f"{_GENERATED}/gait*"),
    "effects": _target("effects", f"{_GENERATED}/effects.*"),
    "accuracy": _target("accuracy", f"{_GENERATED}/accuracy*"),
    "hardcases": _target("hardcases", f"{_GENERATED}/hard-cases.*"),
    "cases": _target("cases", "web/src/cases.json"),
    "random_steps": Artefact(
        None,
        (f"{_GENERATED}/random-steps.png",),
        (
            f"{_PYTHON} -m tests.campaigns.stress --steps 10_000_000 --out {OUT}/stress",
            f"cp {OUT}/stress/evaluations.png {_GENERATED}/random-steps.png",
        ),
    ),
    "performance": _target("performance", f"{_GENERATED}/performance.*"),
    "mutations": _target("mutations", f"{_GENERATED}/mutations.md"),
    "notebooks": _target("notebooks", "docs/notebooks/*.ipynb"),
    "licences": _target("licences", "docs/third-party-licences.txt"),
    "film": _target("film", "docs/*.gif", "docs/iceskate.png"),
}
"""By name, in this order."""


@app.command(help=__doc__)
def main(
    names: Annotated[
        list[str] | None, typer.Argument(help="Only these; again if they were made.")
    ] = None,
    plan: Annotated[bool, typer.Option("--plan", help="Only say what is left to do.")] = False,
) -> None:
    """Make what is missing."""
    for name in names or []:
        if name not in ARTEFACTS:
            raise typer.BadParameter(f"{name}: must be one of {', '.join(ARTEFACTS)}")
        (ROOT / OUT / f"{name}.made").unlink(missing_ok=True)
    left = [
        name
        for name in ARTEFACTS
        if (not names or name in names) and not (ROOT / OUT / f"{name}.made").exists()
    ]
    for name in left:
        made = ARTEFACTS[name]
        time = "?" if made.minutes is None else f"{made.minutes:.0f}"
        typer.echo(f"{name:<16}{time:>4} min  {' '.join(made.files)}")
    known = sum(ARTEFACTS[name].minutes or 0.0 for name in left)
    typer.echo(f"{'in all':<16}{known:4.0f} min of processor time, and what was never measured")
    if plan:
        return
    (ROOT / OUT).mkdir(parents=True, exist_ok=True)
    for name in left:
        for command in ARTEFACTS[name].commands:
            typer.echo(f"\n{name}: {command}")
            done = subprocess.run(command, shell=True, cwd=ROOT)
            if done.returncode:
                raise typer.Exit(done.returncode)
        (ROOT / OUT / f"{name}.made").touch()
    typer.echo("git status, of what was made:")
    files = [pattern for name in left for pattern in ARTEFACTS[name].files]
    subprocess.run(["git", "status", "--short", "--", *files], cwd=ROOT)


if __name__ == "__main__":
    app()
