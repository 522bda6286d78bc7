"""Search by gradients for a gait with a better card: ``python -m training.gaits.gradients``."""

from pathlib import Path
from typing import Annotated

import typer

from skate_env import load_scene
from skate_env.cli.options import number, path
from skate_env.common import prepare_file, write_text
from skate_env.scenes import replace

from .descent import BOUND, MARGIN, Search, Stability
from .scene_file import toml_of
from .search import HumanOption, WeightOption, weights_of

# First half-width of the box [units of variables].
_BOX = 0.2

app = typer.Typer(add_completion=False, pretty_exceptions_enable=False, rich_markup_mode=None)


@app.command()
def main(
    out: Annotated[
        Path, typer.Option(parser=path, help="File of the best scene, updated in the search.")
    ],
    scene: Annotated[str, typer.Option(help="Start from a preset or .toml file.")] = "paper",
    iterations: Annotated[int, typer.Option(min=1, max=10**4, help="Largest number.")] = 30,
    stability: Annotated[
        Stability, typer.Option(help="How the multipliers are bounded.")
    ] = Stability.constraint,
    bound: Annotated[
        float, typer.Option(min=0.0, max=10.0, callback=number, help="Of their moduli.")
    ] = BOUND,
    margin: Annotated[
        float,
        typer.Option(
            min=0.0,
            max=1e3,
            callback=number,
            help="Least depth of the free toe at a landing with the toe below the ice [mm].",
        ),
    ] = MARGIN,
    starts: Annotated[
        int, typer.Option(min=0, max=1000, help="Perturbed starts that must make 100 steps.")
    ] = 0,
    human: HumanOption = False,
    weight: WeightOption = None,
) -> None:
    """Search by gradients; print score, spectral radius and what limits each iteration.

    The search starts from the cycle of a scene, in the limit of short sample periods, and keeps it
    closed and its contact states in their order. It varies K_p, the head's target, the foot and the
    nonzero gains of the stabilizers. The score is the sum of the terms of python -m
    training.gaits.search without those of the contact states.

    With --stability constraint no multiplier may exceed the bound, as in Hassan and Hubicki (2025),
    who bound the diagonal of a Schur decomposition; with penalty its excess is added to the score.
    Where the free toe is at the height of the ice when the heel lands, the order of events changes;
    the search keeps --margin from it. With --starts N a gait counts only if N starts, perturbed by
    0.01 with the seeds 0, 1, ..., make 100 steps; 20 take half a minute for each gait.

    \b
    From a preset, a minute on one core:
      python -m training.gaits.gradients --scene paper --human --out mine.toml
    """  # noqa: D301 (\b keeps the examples' line breaks)
    try:
        chosen = load_scene(scene)
        search = Search(chosen, weights_of(weight or []), human, stability, bound, margin, starts)
        prepare_file(out)
    except (ValueError, OSError) as error:
        typer.echo(f"error: {error}", err=True)
        raise typer.Exit(2) from None
    command = (
        f"python -m training.gaits.gradients --scene {scene}{' --human' * human}"
        + "".join(f" --weight {each}" for each in weight or [])
        + f" --stability {stability.value} --bound {bound:g} --margin {margin:g}"
        + f" --starts {starts}" * (starts > 0)
    )
    box = _BOX

    def show(iteration: int) -> None:
        gait = search.gait
        typer.echo(f"{iteration:3}  score {search.score(gait):8.4f}  radius {gait.radius:.4f}")

    show(0)
    for iteration in range(1, iterations + 1):
        box, reasons = search.iterate(box)
        if reasons:
            typer.echo(f"     {reasons}")
        if not box:
            break
        said = f"{command}: iteration {iteration}"
        found = replace(search.result(), {"name": out.stem, "provenance": said})
        write_text(out, toml_of(found))
        show(iteration)


if __name__ == "__main__":
    app()
