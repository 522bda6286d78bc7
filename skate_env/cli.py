"""The command ``skate-env``: replay or film a scene, say what its effects cost, list the scenes."""

import json
import os
import sys
import textwrap
from pathlib import Path
from typing import Annotated

import typer
from tqdm import tqdm

from . import effects as comparing
from . import effects_report as report
from ._core import EFFECTS
from .accuracy import report as accuracy_report
from .accuracy import settings
from .accuracy import study as studying
from .accuracy.cases import cases
from .bench_command import bench
from .hardcases import report as hardcases_report
from .hardcases import runner
from .hardcases.catalogue import CASES
from .options import JsonOption, SceneOption, fail, value
from .record_command import record
from .replay_command import replay
from .scenes import load_scene, scene_names
from .stress import campaign, episode
from .stress import report as stress_report

app = typer.Typer(
    help="An ice-skating humanoid, simulated: the system of Zhang et al.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)
app.command()(replay)
app.command()(record)
app.command()(bench)


@app.command()
def scenes() -> None:
    """List the scenes that come with the package, and the effects that each calls for."""
    for name in scene_names():
        scene = load_scene(name)
        fields = json.loads(scene.to_json())
        typer.echo(f"{name}\n    {fields['description']}\n    from: {fields['provenance']}")
        on = ", ".join(effect for effect, is_on in scene.effects().items() if is_on)
        typer.echo(textwrap.fill(f"    effects: {on}", 100, subsequent_indent=" " * 13))


@app.command()
def effects(
    scene: SceneOption = "paper",
    out: Annotated[
        Path | None, typer.Option(help="Folder for table and chart; it is made if need be.")
    ] = None,
    quick: Annotated[
        bool, typer.Option("--quick", help="Fewer rounds: times are rougher, counts the same.")
    ] = False,
    only_list: Annotated[
        bool, typer.Option("--list", help="Only say what each effect is; * marks the scene's.")
    ] = False,
    as_json: JsonOption = False,
) -> None:
    """Say what each effect of a scene costs, and what it changes.

    The scene as it is stands against copies with one effect left out or added, and some with
    several left out: their size, evaluations of the dynamics, instructions (where valgrind is
    installed), time, the time that MuJoCo takes for the same bodies (where mujoco is installed),
    and how far the motion strays. The folder given by --out receives effects.csv, effects.png
    and effects.md, the table for a document.

    \b
    What effects there are:
      skate-env effects --list
    What the paper's scene pays for its arms, its ledger, its friction:
      skate-env effects
    A first look at another scene:
      skate-env effects --scene blade --quick
    A file of your own; table, chart, and a machine-readable result:
      skate-env effects --scene mine.toml --json --out out/effects

    Leave the machine alone meanwhile; the table says how sure its times are.
    """  # noqa: D301 (\b keeps the examples' line breaks)
    try:
        chosen = load_scene(scene)
        if only_list:
            for effect, is_on in chosen.effects().items():
                typer.echo(f"{'*' if is_on else ' '} {effect:<22}{EFFECTS[effect]}")
            return
        if out is not None:
            out.mkdir(parents=True, exist_ok=True)
        rounds = comparing.QUICK_ROUNDS if quick else comparing.ROUNDS
        table = comparing.compare(chosen, rounds)
        if out is not None:
            command = f"skate-env effects --scene {scene}{' --quick' * quick}"
            report.write(table, out, command)
    except (ValueError, OSError) as error:
        fail(error)
    typer.echo(report.text(table))
    if out is not None:
        typer.echo(f"written to {out}")
    if as_json:
        typer.echo(json.dumps(report.summary(table), allow_nan=False))


@app.command()
def accuracy(
    scene: Annotated[
        list[str] | None,
        typer.Option("--scene", metavar="NAME", help="Only this motion; may be repeated."),
    ] = None,
    quick: Annotated[
        bool, typer.Option("--quick", help="Fewer settings, starts and rounds, no instructions.")
    ] = False,
    out: Annotated[
        Path | None, typer.Option(help="Folder for tables and figures; it is made if need be.")
    ] = None,
    only_list: Annotated[
        bool, typer.Option("--list", help="Only say what the motions are.")
    ] = False,
    as_json: JsonOption = False,
) -> None:
    """Say what accuracy costs: every method at every setting, its errors and its time.

    Motions from smooth to nasty are computed by each method of the engine, coarse to fine, and by
    MuJoCo where it is installed. Errors are those against the engine's own tightest tolerance,
    which SciPy's solvers check where scipy is installed. The folder given by --out receives
    accuracy.png (all motions), accuracy_NAME.png for each of them, accuracy.md (tables for a
    document), accuracy.csv (a row for each motion, method and setting), accuracy_reference.csv
    (how far the references disagree), accuracy_prices.csv, accuracy_orders.csv and
    accuracy_walks.csv (a hundred steps).

    \b
    What motions there are:
      skate-env accuracy --list
    A first look, within two minutes:
      skate-env accuracy --quick
    Two motions at length:
      skate-env accuracy --scene slide --scene cycle --out out/accuracy

    Leave the machine alone meanwhile; the tables say how sure the times are.
    """  # noqa: D301 (\b keeps the examples' line breaks)
    if only_list:
        for case in cases().values():
            typer.echo(f"{case.name:<14}{case.title} ({case.duration:g} s)")
        return
    try:
        if out is not None:
            out.mkdir(parents=True, exist_ok=True)
        extent = settings.quick() if quick else settings.full()
        study = studying.make(scene or [], extent)
        if out is not None:
            chosen = "".join(f" --scene {name}" for name in scene or [])
            command = f"skate-env accuracy{chosen}{' --quick' * quick}"
            accuracy_report.write(study, out, command)
    except (ValueError, OSError) as error:
        fail(error)
    typer.echo(accuracy_report.text(study))
    if out is not None:
        typer.echo(f"written to {out}")
    if as_json:
        typer.echo(json.dumps(study.summary(), allow_nan=False))


@app.command()
def hardcases(
    case: Annotated[
        list[str] | None,
        typer.Option("--case", metavar="NAME", help="Only this case; may be repeated."),
    ] = None,
    method: Annotated[
        list[str] | None,
        typer.Option(
            "--method",
            metavar="NAME",
            help="balanced, reference, fast, rosenbrock, rk4, or all; may be repeated. Without it "
            "the first three.",
        ),
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="Folder for tables and picture; it is made if need be.")
    ] = None,
    only_list: Annotated[bool, typer.Option("--list", help="Only say what the cases are.")] = False,
    as_json: JsonOption = False,
) -> None:
    """Run cases that break naive simulators, and say how far each is from its limit.

    A case sets the robot up where a simple code fails: contact forces that do not exist or are
    not unique, friction at rest, landings without end, numbers next to nothing. It measures how
    far the motion is from a law of mechanics, and passes where that is at most a limit. The
    margin is the limit divided by what is measured: 1 just passes, `exact` stands for a measured
    0. The cost is that of a simulated second, in evaluations of the dynamics, over that of the
    paper's gait; it repeats exactly, as a time does not.

    The command fails (exit status 1) where any case does. The folder given by --out receives
    hard-cases.png (all margins), hard-cases.md (every case at length, for a document) and
    hard-cases.csv (a row for each case and method).

    \b
    What cases there are:
      skate-env hardcases --list
    All of them at the accuracies that have a name:
      skate-env hardcases
    Two cases at every method:
      skate-env hardcases --case painleve_heel --case rattling_sole --method all
    Everything, for the documentation:
      skate-env hardcases --method all --out out/hardcases

    A method that does not claim a case is not run on it; the notes below the table say why.
    """  # noqa: D301 (\b keeps the examples' line breaks)
    if only_list:
        typer.echo(hardcases_report.listing(list(CASES.values())))
        return
    try:
        if out is not None:
            out.mkdir(parents=True, exist_ok=True)
        done = runner.run(case or [], method or [])
        if out is not None:
            chosen = "".join(f" --case {name}" for name in case or [])
            chosen += "".join(f" --method {name}" for name in method or [])
            hardcases_report.write(done, out, f"skate-env hardcases{chosen}")
    except (ValueError, OSError) as error:
        fail(error)
    typer.echo(hardcases_report.text(done))
    if out is not None:
        typer.echo(f"written to {out}")
    if as_json:
        typer.echo(json.dumps(hardcases_report.summary(done), allow_nan=False))
    if not done.passed:
        raise typer.Exit(1)


@app.command()
def stress(
    steps: Annotated[int, typer.Option(min=1, help="How many steps to make, or a few more.")] = (
        100_000
    ),
    seed: Annotated[int, typer.Option(min=0, help="Seed of scenes and torques.")] = 0,
    accuracy: Annotated[
        str, typer.Option(help="Of all scenes: a name, a tolerance, or JSON, as for replay.")
    ] = "balanced",
    jobs: Annotated[
        int | None, typer.Option(min=1, help="Processes; as many as there are cores.")
    ] = None,
    out: Annotated[Path | None, typer.Option(help="Folder for table, picture and scenes.")] = None,
    only: Annotated[
        int | None, typer.Option("--episode", min=0, help="Only this episode; write its scene.")
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Step random scenes with random torques: all must go well, and no step take long.

    An episode is a random valid scene from its start, for 200 steps of 10 ms or to its end. The
    seed and the number of an episode decide all of it. The command fails (exit status 1) where a
    number is not finite, an end has no name, a snapshot does not continue as before, the engine
    panics or an episode takes longer than a minute, and where a step needs more than 50 times
    the median evaluations of the dynamics.

    The folder given by --out receives ends.csv, evaluations.png (a histogram of what steps cost)
    and costliest_*.toml, the scenes of the costliest steps.

    \b
    Ten million steps, the whole check:
      skate-env stress --steps 10_000_000 --out out/stress
    One episode again; its scene goes to out/episode/episode_17.toml:
      skate-env stress --seed 0 --episode 17 --out out/episode
    """  # noqa: D301 (\b keeps the examples' line breaks)
    try:
        if out is not None:
            out.mkdir(parents=True, exist_ok=True)
        if only is not None:
            done = episode.run(seed, only, value(accuracy))
            said, passed = stress_report.episode_summary(done), not done.failures
            typer.echo(stress_report.episode_text(done))
            stress_report.write_episode(seed, only, value(accuracy), out)
        else:
            with tqdm(total=steps, unit="step", file=sys.stderr) as bar:
                result = campaign.make(
                    seed, steps, value(accuracy), jobs or os.cpu_count() or 1, bar.update
                )
            said, passed = stress_report.summary(result), result.passed
            typer.echo(stress_report.text(result))
            if out is not None:
                stress_report.write(result, out)
    except (ValueError, OSError) as error:
        fail(error)
    if out is not None:
        typer.echo(f"{'written to':<20}{out}")
    if as_json:
        typer.echo(json.dumps(said, allow_nan=False))
    if not passed:
        raise typer.Exit(1)
