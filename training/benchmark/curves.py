"""Learning curves: ``python -m training.benchmark.curves --run 'residual=out/push_only/*' ...``."""

from pathlib import Path
from typing import Annotated

import matplotlib.pyplot as plt
import numpy as np
import typer
from matplotlib.figure import Figure
from numpy.typing import NDArray
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

from skate_env.cli.options import fail, named_paths, path
from skate_env.common import literal, prepare_file, write_figure

Array = NDArray[np.float64]

# Tags of TensorBoard, and labels of the axes.
PANELS = {
    "episode/lasted_s": "episode [s]",
    "episode/period_s": "period of a step [s]",
    "episode/loaded_slide_per_step_m": "loaded slide per step [m]",
    "episode/flight_share": "both feet in the air\n(share of the time)",
}
POINTS = 200


def curve(folder: Path, tag: str) -> tuple[Array, Array]:
    """Read one scalar of a training.

    Returns
    -------
    tuple
        Actions (n,) and values (n,), with all parts of a resumed training.

    Raises
    ------
    ValueError
        If the folder does not contain the scalar.
    """
    # 0: no limit.
    events = EventAccumulator(str(folder), size_guidance={"scalars": 0}).Reload()
    if tag not in events.Tags()["scalars"]:
        raise ValueError(f"{folder}: holds no {tag} of a training")
    points = events.Scalars(tag)
    return np.array([p.step for p in points], float), np.array([p.value for p in points])


def draw(runs: dict[str, list[Path]]) -> Figure:
    """Draw trainings by name: mean and range over their seeds.

    Raises
    ------
    ValueError
        As in `curve`.
    """
    figure, axes = plt.subplots(
        len(PANELS), 1, figsize=(7.0, 9.0), sharex=True, layout="constrained"
    )
    for ax, (tag, label) in zip(axes, PANELS.items(), strict=True):
        for name, folders in runs.items():
            curves = [curve(folder, tag) for folder in folders]
            first = max(actions[0] for actions, _ in curves)
            last = min(actions[-1] for actions, _ in curves)
            shown = np.linspace(first, last, POINTS)
            values = np.stack([np.interp(shown, *each) for each in curves])
            seeds = f"{len(folders)} seed{'s' if len(folders) > 1 else ''}"
            (line,) = ax.plot(shown / 1e6, values.mean(axis=0), label=f"{literal(name)}, {seeds}")
            least, most = values.min(axis=0), values.max(axis=0)
            ax.fill_between(shown / 1e6, least, most, alpha=0.25, color=line.get_color(), lw=0)
        ax.set_ylabel(label)
        ax.set_ylim(bottom=0.0)
        ax.grid(alpha=0.3)
    axes[0].legend(loc="upper left")
    axes[-1].set_xlabel("actions of 10 ms [million]")
    return figure


def main(
    run: Annotated[
        list[str],
        typer.Option(
            metavar="NAME=FILES", help="Folders; * matches several seeds; may be repeated."
        ),
    ],
    out: Annotated[
        Path, typer.Option(parser=path, help="The picture, for example out/curves.png.")
    ],
) -> None:
    """Draw learning curves: means and ranges over training seeds.

    \b
    The folders are those of skate-env train --out:
      python -m training.benchmark.curves --run 'residual=out/push_only/*' \\
        --run 'scratch=out/scratch/*' --out out/curves.png
    """  # noqa: D301 (\b keeps the example's line break)
    try:
        figure = draw(named_paths("--run", run))
        prepare_file(out)
        write_figure(out, figure, 150)
    except (ValueError, OSError) as error:
        fail(error)
    typer.echo(f"written to {out}")


if __name__ == "__main__":
    app = typer.Typer(add_completion=False, pretty_exceptions_enable=False, rich_markup_mode=None)
    app.command()(main)
    app()
