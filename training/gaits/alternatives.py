"""What other readings of the paper make of a gait: ``python -m training.gaits.alternatives``.

Each alternative changes a scene in one respect. Its gait is scored without other changes, and after
a search of the same length for each.
"""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from joblib import Parallel, delayed

from skate_env import Scene, load_scene
from skate_env.cli.options import MOST_JOBS, path
from skate_env.common import prepare_folder, progress_bar, write_text
from skate_env.gait import Motion, contact
from skate_env.scenes import replace

from .evolution import Objective, Stage, search
from .score import run as simulate
from .score import score, terms
from .variables import variables

# See `tightest`.
STEPS, STAGE_SIGMA, STAGE_SEEDS = 30, 0.01, range(2)
SPREAD = 0.01
SOLES = (0.18, 0.22, 0.25, 0.28)
KNEE_STOP = {"stiffness": 300.0, "damping": 0.02}


def alternatives(scene: Scene) -> dict[str, dict[str, Any]]:
    """Return the changes of a scene with visual lifting, by name."""
    tree = json.loads(scene.to_json())
    lifting, foot = tree["control"]["lifting"], tree["body"]["foot"]
    length = foot["toe"] + foot["heel"]
    lower = lifting["height"] - 0.5 * tree["body"]["head"]["length"]
    k = lifting["K_p"]
    found: dict[str, dict[str, Any]] = {
        "none": {},
        "psi at the head's centre, its target as much lower": {
            "control.psi": 0.5,
            "control.lifting.height": lower,
        },
        "t_2 from the flat free foot (7 to 15)": {"control.feedforward.t2": "flat"},
        "d_1 = 1 N m s/rad": {"contact.edge_damping": 1.0},
        "the free toe touches alone": {"contact.toe_contact": True},
        "knee stop, 300 N m/rad": {"stabilizers.knee_stop": KNEE_STOP},
        "K_p along z halved": {"control.lifting.K_p": [*k[:2], 0.5 * k[2]]},
        "K_p along z doubled": {"control.lifting.K_p": [*k[:2], 2.0 * k[2]]},
        "target 0.1 m less ahead": {"control.lifting.ahead": lifting["ahead"] - 0.1},
        "target 0.02 m lower": {"control.lifting.height": lifting["height"] - 0.02},
        "Eq. 13 as printed while N < 0": {"contact.pulled_friction": "literal"},
        "the free heel is not held while N < 0": {"contact.point_contact_holds": False},
        "no damping of the head": {"stabilizers.head_damping": None},
    }
    for sole in SOLES:
        found[f"sole of {sole:g} m"] = {
            f"body.foot.{end}": foot[end] * sole / length for end in ("toe", "heel")
        }
    return found


@dataclass(frozen=True)
class Result:
    """Complete steps of `STEPS` - 1, share in order, score, and unmet terms in units."""

    steps: int
    in_order: float
    score: float
    unmet: dict[str, float]


def _result(motion: Motion) -> Result:
    far = {name: x for name, x in terms(motion, human=False).items() if x > 0.0}
    share = contact.order_share(motion.orders, standing_as_sliding=False)
    total = score(motion, {}, human=False)
    return Result(len(motion.orders), 0.0 if np.isnan(share) else share, total, far)


def judge(scene: str, changes: dict[str, Any], budget: int, seed: int) -> list[Result] | None:
    """Results of a changed scene (JSON) without and with a search; None if it is impossible."""
    try:
        changed = replace(Scene.from_json(scene), changes)
        before = simulate(changed, STEPS, 0.0, 0)
    except ValueError:
        return None
    objective = Objective(changed.to_json(), variables(changed, []), STEPS, {}, human=False)
    found = list(search(objective, [Stage(budget, STAGE_SIGMA, STAGE_SEEDS)], SPREAD, seed, 1))
    best = found[-1][0] if found else changed
    return [_result(before), _result(simulate(best, STEPS, 0.0, 0))]


def row(name: str, results: list[Result] | None) -> str:
    """Format one alternative as a row of a Markdown table."""
    if results is None:
        return f"| {name} | impossible start | | | |"
    cells = [f"{r.steps}, {100 * r.in_order:.0f} % | {r.score:.4f}" for r in results]
    return f"| {name} | {' | '.join(cells)} |"


app = typer.Typer(add_completion=False, pretty_exceptions_enable=False, rich_markup_mode=None)


@app.command()
def main(
    out: Annotated[Path, typer.Option(parser=path, help="Folder of the results.")],
    scene: Annotated[str, typer.Option(help="A preset or .toml file.")] = "paper",
    budget: Annotated[int, typer.Option(min=1, max=10**9, help="Candidates of a search.")] = 100,
    seed: Annotated[int, typer.Option(min=0, max=2**31 - 1, help="Seed of the searches.")] = 0,
    workers: Annotated[int, typer.Option(min=1, max=MOST_JOBS, help="Processes.")] = 1,
) -> None:
    """Score what other readings of the paper make of a gait, and write a table."""
    try:
        chosen = load_scene(scene)
        changes = alternatives(chosen)
        prepare_folder(out)
    except (ValueError, OSError, TypeError) as error:
        typer.echo(f"error: {error}", err=True)
        raise typer.Exit(2) from None
    text = chosen.to_json()
    calls = (delayed(judge)(text, each, budget, seed) for each in changes.values())
    results = []
    with progress_bar(len(changes), "alternatives", "scene") as bar:
        for found in Parallel(n_jobs=workers, return_as="generator")(calls):
            results.append(found)
            bar.update()
    head = [
        f"| changed | steps of {STEPS - 1}, in order | score | after a search | score |",
        "|---|---|---|---|---|",
    ]
    table = [*head, *map(row, changes, results)]
    unmet = {
        name: found and [result.unmet for result in found]
        for name, found in zip(changes, results, strict=True)
    }
    write_text(out / "alternatives.md", "\n".join(table) + "\n")
    write_text(out / "alternatives.json", json.dumps(unmet, indent=1) + "\n")
    typer.echo("\n".join(table))


if __name__ == "__main__":
    app()
