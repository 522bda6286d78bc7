"""How far each limit of a gait can be tightened: ``python -m training.gaits.tightest``.

One search per limit, with the order of contact states as its only other term.
"""

import json
from pathlib import Path
from typing import Annotated, Any

import typer
from joblib import Parallel, delayed
from matplotlib.figure import Figure

from skate_env import load_scene
from skate_env.cli.options import MOST_JOBS, path
from skate_env.common import prepare_folder, progress_bar, write_figure, write_text
from skate_env.gait import Motion

from .evolution import Objective, Stage, search
from .score import TERMS, run
from .variables import variables

ORDER = ("order", "in_order", "time_in_15", "swap_from_14")
UNITS = {
    "free_foot_in_air": ("free foot in the air", ""),
    "landing_toe": ("free toe at the landing", "mm"),
    "deepest_toe": ("deepest free toe", "mm"),
    "sole": ("sole", "m"),
    "target_height": ("head target, height", "m"),
    "target_ahead": ("head target, ahead", "m"),
    "largest_pull": ("largest pull", "body weights"),
    "head_damping": ("head damping", "N s/m"),
    "knees_backward": ("knee backward", "rad"),
    "ankle_torque": ("ankle torque", "N m"),
    "largest_lift": ("lift on the head", "body weights"),
}
# A gait is scored from perturbed starts over many steps; few steps show the way to the cycle only.
STEPS, STAGE_SIGMA, STAGE_SEEDS = 30, 0.01, range(2)
# Steps of the runs that are reported.
REPORTED = 100
SPREAD = 0.01


def tighten(scene: str, name: str, budget: int, seed: int) -> dict[str, Any]:
    """Return a term in the gait of ``scene`` (file or preset) and in the best gait found."""
    start = load_scene(scene)
    weights = {term: float(term == name or term in ORDER) for term in TERMS}
    objective = Objective(start.to_json(), variables(start, []), STEPS, weights, human=True)
    found = list(search(objective, [Stage(budget, STAGE_SIGMA, STAGE_SEEDS)], SPREAD, seed, 1))
    best = found[-1][0] if found else start
    before, after = (run(each, REPORTED, 0.0, 0) for each in (start, best))

    def in_order(motion: Motion) -> bool:
        return len(motion.orders) == REPORTED - 1 and all(step.in_order() for step in motion.orders)

    return {
        "before": TERMS[name].measure(before),
        "after": TERMS[name].measure(after),
        "in_order": in_order(before) and in_order(after),
        "scene": json.loads(best.to_json()),
    }


def draw(found: dict[str, dict[str, Any]]) -> Figure:
    """Draw the share of the way to each limit that the searches made."""
    figure = Figure(figsize=(9.0, 5.0), layout="constrained")
    ax = figure.subplots()
    for row, (name, values) in enumerate(found.items()):
        limit = TERMS[name].limit(human=True)
        before, after = values["before"], values["after"]
        wanted = min(max(before, limit.at_least), limit.at_most)
        share = 1.0 if wanted == before else (after - before) / (wanted - before)
        reached = f"to {after:.4g}" if values["in_order"] else "no further in the order"
        ax.barh(row, values["in_order"] * min(max(share, 0.0), 1.0), color="#0072B2")
        said = f"{before:.4g} {reached}, limit {limit} {UNITS[name][1]}"
        ax.text(1.02, row, said, va="center")
    ax.set_yticks(range(len(found)), [UNITS[name][0] for name in found])
    ax.invert_yaxis()
    ax.set(xlim=(0.0, 1.0), xlabel="share of the way to the limit, in the paper's order [1]")
    return figure


app = typer.Typer(add_completion=False, pretty_exceptions_enable=False, rich_markup_mode=None)


@app.command()
def main(
    out: Annotated[Path, typer.Option(parser=path, help="Folder of the results.")],
    scene: Annotated[str, typer.Option(help="A preset or .toml file, in the order.")] = "paper",
    budget: Annotated[int, typer.Option(min=1, max=10**9, help="Candidates of a search.")] = 250,
    seed: Annotated[int, typer.Option(min=0, max=2**31 - 1, help="Seed of the searches.")] = 0,
    workers: Annotated[int, typer.Option(min=1, max=MOST_JOBS, help="Processes.")] = 1,
) -> None:
    """Tighten each limit of a gait alone, and draw how far it went."""
    try:
        load_scene(scene)
        prepare_folder(out)
    except (ValueError, OSError) as error:
        typer.echo(f"error: {error}", err=True)
        raise typer.Exit(2) from None
    calls = (delayed(tighten)(scene, name, budget, seed) for name in UNITS)
    found = {}
    with progress_bar(len(UNITS), "limits", "limit") as bar:
        results = Parallel(n_jobs=workers, return_as="generator")(calls)
        for name, values in zip(UNITS, results, strict=True):
            found[name] = values
            bar.update()
    write_figure(out / "tightest.png", draw(found), dpi=120)
    head = ["| limit | unit | paper | tightest | required |", "|---|---|---|---|---|"]
    rows = [
        f"| {UNITS[name][0]} | {UNITS[name][1]} | {values['before']:.4g} | "
        f"{format(values['after'], '.4g') if values['in_order'] else 'order lost'} "
        f"| {TERMS[name].limit(human=True)} |"
        for name, values in found.items()
    ]
    write_text(out / "tightest.md", "\n".join(head + rows) + "\n")
    write_text(out / "tightest.json", json.dumps(found, indent=1) + "\n")
    typer.echo("\n".join(head + rows))


if __name__ == "__main__":
    app()
