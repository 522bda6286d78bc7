"""Compare controllers over perturbed starts: ``python -m training.evaluate --scene unilateral``.

Every controller skates from the same starts, under the same kicks, none of which training has seen.
Policies of several training seeds count as one controller.
"""

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from numpy.typing import NDArray
from tqdm import tqdm

from skate_env import baseline
from skate_env.options import SceneOption, fail
from skate_env.policy import Policy
from skate_env.scenes import load_scene

from .named import named_paths
from .statistics import Estimate, interquartile_mean
from .trial import UNITS, Conditions, Controller, run

Array = NDArray[np.float64]

# What a table shows of `UNITS`, and how: per cent of episodes are plain means.
SHARES = ("completed", "fell")


@dataclass(frozen=True)
class Entrant:
    """A controller, or several that differ in their training's seed.

    Attributes
    ----------
    name
        For tables.
    controllers
        Each with its keywords of the environment.
    deterministic
        Whether they do without noise.
    """

    name: str
    controllers: Sequence[tuple[Controller, dict[str, Any]]]
    deterministic: bool = True


def entrants(scene: str, policies: list[str]) -> list[Entrant]:
    """Make the baseline, its lifting alone, and each ``NAME=FILES`` with and without noise.

    Raises
    ------
    ValueError
        If there is no such scene or file, or a file holds no policy.
    """
    whole = baseline.no_residual(load_scene(scene))
    lifting = baseline.lifting_only(load_scene(scene))
    every = [
        Entrant(name, [(each, {"scene": each.scene})])
        for name, each in (("baseline", whole), ("lifting only", lifting))
    ]
    for entry in policies:
        name, paths = named_paths("--policy", entry)
        loaded = [Policy.load(path) for path in paths]
        trained = [(policy, policy.environment()) for policy in loaded]
        every.append(Entrant(name, trained))
        every.append(Entrant(f"{name}, with noise", trained, deterministic=False))
    return every


def measure(entrant: Entrant, conditions: Conditions) -> dict[str, Array]:
    """Run an entrant's controllers; returns `UNITS` by name, (controllers, starts)."""
    total = len(entrant.controllers) * conditions.starts
    with tqdm(total=total, desc=entrant.name, unit="episode") as bar:
        runs = [
            run(
                controller,
                environment,
                conditions,
                deterministic=entrant.deterministic,
                progress=bar.update,
            )
            for controller, environment in entrant.controllers
        ]
    return {name: np.stack([one[name] for one in runs]) for name in UNITS}


def table(results: dict[str, dict[str, Array]]) -> str:
    """Lay figures out for a document: a row for each figure, a column for each controller."""
    lines = [f"| | {' | '.join(results)} |", "|---" * (len(results) + 1) + "|"]
    for name, unit in UNITS.items():
        cells = []
        for measured in results.values():
            if name in SHARES:
                cells.append(f"{np.mean(measured[name]):.1%}")
            else:
                cells.append(_cell(interquartile_mean(measured[name])))
        label = name.replace("_", " ") + (f" [{unit}]" if unit != "1" else "")
        lines.append(f"| {label} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def _cell(estimate: Estimate) -> str:
    if np.isnan(estimate.mean):
        return "-"
    return f"{estimate.mean:.3g} ({estimate.low:.3g} to {estimate.high:.3g})"


def main(
    out: Annotated[Path, typer.Option(help="Folder for the table; it is made if need be.")],
    scene: SceneOption = "unilateral",
    policy: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME=FILES", help="A controller; may be repeated. * for many seeds."),
    ] = None,
    starts: Annotated[int, typer.Option(min=1, help="Episodes of each controller.")] = 64,
    steps: Annotated[int, typer.Option(min=1, help="What a whole episode is.")] = 100,
    perturb: Annotated[float, typer.Option(min=0.0, help="See IceSkateEnv.")] = 0.02,
    trunk_noise: Annotated[float, typer.Option(min=0.0, help="Likewise [rad].")] = 0.01,
    kick: Annotated[float, typer.Option(min=0.0, help="Likewise [m/s].")] = 0.0,
    accuracy: Annotated[str, typer.Option(help="fast, balanced or reference.")] = "balanced",
) -> None:
    """Compare controllers over perturbed starts.

    The baseline and its lifting alone take part as well. The table shows interquartile means and
    their 95 % bootstrap intervals, stratified by start (Agarwal et al. 2021); episodes completed
    and falls are shares of all. The folder receives evaluation.md and evaluation.json (every
    episode).

    \b
    The baseline, pushed now and then by 0.6 m/s:
      python -m training.evaluate --scene paper --kick 0.6 --out out/evaluation
    Several seeds of your own against learning from scratch:
      python -m training.evaluate --policy 'residual=out/unilateral/*/policy.npz' \\
        --policy 'scratch=out/scratch/*/policy.npz' --out out/evaluation
    """  # noqa: D301 (\b keeps the examples' line breaks)
    conditions = Conditions(
        starts=starts,
        steps=steps,
        disturbances={"perturb": perturb, "trunk_noise": trunk_noise, "kick": kick},
        accuracy=accuracy,
    )
    try:
        out.mkdir(parents=True, exist_ok=True)
        results = {
            entrant.name: measure(entrant, conditions) for entrant in entrants(scene, policy or [])
        }
    except (ValueError, OSError) as error:
        fail(error)
    text = table(results)
    typer.echo(text)
    (out / "evaluation.md").write_text(text + "\n", encoding="utf-8")
    episodes = {
        name: {figure: values.tolist() for figure, values in measured.items()}
        for name, measured in results.items()
    }
    told = {"conditions": asdict(conditions), "episodes": episodes}
    (out / "evaluation.json").write_text(json.dumps(told), encoding="utf-8")


app = typer.Typer(add_completion=False, pretty_exceptions_enable=False, rich_markup_mode=None)
app.command()(main)

if __name__ == "__main__":
    app()
