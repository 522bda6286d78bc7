"""The command of a search."""

from pathlib import Path
from typing import Annotated

import typer

from skate_env import Scene, load_scene
from skate_env.cli.options import MOST_EPISODES, MOST_JOBS, MOST_STEPS, number, path
from skate_env.common import prepare_file, write_text
from skate_env.replay import TAU8
from skate_env.scenes import replace

from .evolution import Objective, Stage, search
from .scene_file import settled, toml_of
from .score import known_terms
from .variables import Group, variables

app = typer.Typer(add_completion=False, pretty_exceptions_enable=False, rich_markup_mode=None)


def weights_of(given: list[str]) -> dict[str, float]:
    """Read weights such as ``largest_pull=2``.

    Raises
    ------
    ValueError
        For an unknown term, or a weight that is not a number from 0 to 1e6.
    """
    weights = {}
    for each in given:
        name, _, value = each.partition("=")
        if name not in known_terms():
            raise ValueError(f"no term {name!r} for --weight; terms: {', '.join(known_terms())}")
        try:
            weights[name] = float(value)
        except ValueError:
            raise ValueError(f"--weight {each}: {value!r} is no number") from None
        if not 0.0 <= weights[name] <= 1e6:
            raise ValueError(f"--weight {each}: a weight lies between 0 and 1e6")
    return weights


def start_of(scene: str, settle: int, arms: bool) -> Scene:
    """Return the scene that a search starts from; raises as `load_scene` and `settled`."""
    chosen = load_scene(scene)
    if arms:
        chosen = replace(chosen, TAU8)
    return settled(chosen, settle) if settle else chosen


@app.command()
def main(
    out: Annotated[
        Path, typer.Option(parser=path, help="File of the best scene, updated during the search.")
    ],
    scene: Annotated[str, typer.Option(help="Start from a preset or .toml file.")] = "paper",
    budget: Annotated[int, typer.Option(min=1, max=10**9, help="Number of candidates.")] = 20000,
    steps: Annotated[
        int, typer.Option(min=2, max=MOST_STEPS, help="Gait steps of a complete run.")
    ] = 30,
    final: Annotated[
        float, typer.Option(min=0.0, max=1.0, callback=number, help="Share of the final stage.")
    ] = 0.3,
    sigma: Annotated[
        float,
        typer.Option(min=0.0, max=10.0, callback=number, help="Perturbation in it [rad, rad/s]."),
    ] = 0.01,
    episodes: Annotated[
        int, typer.Option(min=1, max=MOST_EPISODES, help="Perturbed episodes per candidate in it.")
    ] = 4,
    spread: Annotated[
        float,
        typer.Option(min=1e-6, max=1e3, callback=number, help="Width of the first generation."),
    ] = 0.1,
    settle: Annotated[
        int, typer.Option(min=0, max=MOST_STEPS, help="Start after this many steps.")
    ] = 0,
    arms: Annotated[bool, typer.Option("--arms", help="With tau8, for opposed arms.")] = False,
    human: Annotated[
        bool, typer.Option("--human", help="With the limits of a human: ankle, pull, lift.")
    ] = False,
    weight: Annotated[
        list[str] | None, typer.Option(help="TERM=FACTOR, a factor on its weight; repeatable.")
    ] = None,
    freeze: Annotated[
        list[Group] | None, typer.Option(help="Keep a group of variables fixed; repeatable.")
    ] = None,
    seed: Annotated[int, typer.Option(min=0, max=2**31 - 1, help="Seed of the search.")] = 0,
    workers: Annotated[
        int, typer.Option(min=1, max=MOST_JOBS, help="Number of parallel processes.")
    ] = 1,
) -> None:
    """Search for parameters that the paper leaves open; write the best scene.

    The search starts from a scene and varies K_p, the head's target, the foot, the nonzero gains of
    its stabilizers and its start. Contact, friction and the published torques do not change. The
    score is the number of missing steps, plus a number below 1 that says how far the card of the
    gait (python -m training.gaits) is from its requirements; README.md beside this file lists the
    terms. In the final stage it is the mean over several perturbed starts. CMA-ES restarts from the
    best candidate when it stagnates.

    \b
    From a preset, about two hours on two cores:
      python -m training.gaits.search --scene paper --workers 2 --out mine.toml
    All runs perturbed, with the pull of the soles five times as heavy:
      python -m training.gaits.search --scene mine.toml --final 1 --spread 0.01 \\
        --weight largest_pull=5 --out b.toml
    The card of the result:
      python -m training.gaits --scene mine.toml

    The result does not depend on the number of workers.
    """  # noqa: D301 (\b keeps the examples' line breaks)
    freeze = freeze or []
    try:
        weights = weights_of(weight or [])
        chosen = start_of(scene, settle, arms)
        searched = variables(chosen, freeze)
        if len(searched) < 2:
            raise ValueError("fewer than two numbers are left to search; freeze fewer groups")
        prepare_file(out)
    except (ValueError, OSError) as error:
        typer.echo(f"error: {error}", err=True)
        raise typer.Exit(2) from None
    last = round(budget * final)
    stages = [
        Stage(budget - last, 0.0, range(1)),
        Stage(last, sigma, range(seed, seed + episodes)),
    ]
    command = (
        f"python -m training.gaits.search --scene {scene}{' --arms' * arms}{' --human' * human}"
        + "".join(f" --weight {each}" for each in weight or [])
        + "".join(f" --freeze {group.value}" for group in freeze)
        + f" --budget {budget} --final {final:g} --steps {steps} --settle {settle}"
        + f" --sigma {sigma:g} --episodes {episodes} --spread {spread:g} --seed {seed}"
    )
    best = None
    objective = Objective(chosen.to_json(), searched, steps, weights, human)
    for found, candidates, best in search(objective, stages, spread, seed, workers):
        provenance = f"{command}: {candidates} candidates, score {best:.4f}"
        found = replace(found, {"name": out.stem, "provenance": provenance})
        write_text(out, toml_of(found))
    typer.echo("no candidate has a valid start" if best is None else f"score {best:.4f}, in {out}")


if __name__ == "__main__":
    app()
