"""``python -m training.orbits``: the periodic orbit of a gait."""

from pathlib import Path
from typing import Annotated

import typer

from skate_env.cli import options
from skate_env.cli.options import JsonOption, SkatedOption, number, path
from skate_env.common import prepare_file, prepare_folder

app = typer.Typer(add_completion=False, pretty_exceptions_enable=False, rich_markup_mode=None)


@app.command()
def orbit(
    scene: SkatedOption = None,
    policy: Annotated[
        str | None,
        typer.Option(
            metavar="FILE|shipped",
            help="Close an orbit near the motion of a learned policy, with its residual torques.",
        ),
    ] = None,
    accuracy: Annotated[
        str, typer.Option(help="balanced, reference, a relative tolerance, or JSON.")
    ] = "reference",
    out: Annotated[
        Path | None,
        typer.Option(parser=path, help="Folder for JSON and picture; created if missing."),
    ] = None,
    feedback: Annotated[
        Path | None,
        typer.Option(parser=path, help="File for a linear feedback; its folder is created."),
    ] = None,
    torque_weight: Annotated[
        float,
        typer.Option(
            min=1e-6,
            max=1e6,
            callback=number,
            help="Weight of a full torque in the feedback's design, beside 1 for 1 rad.",
        ),
    ] = 1.0,
    limit: Annotated[
        float,
        typer.Option(
            min=1e-9, max=1e9, callback=number, help="Cost-to-go up to which the feedback grows."
        ),
    ] = 1e9,
    as_json: JsonOption = False,
) -> None:
    """Close the periodic orbit of a gait, and measure it.

    The command simulates a scene until its motion comes near to itself, closes the orbit by
    Newton's method, and prints residual, period, contact states, Floquet multipliers, margins of
    the order of events, the decay of a deviation beside the predicted one, and the largest noise
    from which the motion returns. If the controller's samples allow no short orbit, their period
    is an unknown as well; see docs/orbits.md.

    With --policy the orbit has periodic residual torques: the step of the policy's motion that
    comes nearest to itself is made periodic, by changes of its torques and its start.

    With --feedback it designs a feedback in residual torques by the periodic Riccati equation, and
    writes it to a file for skate-env evaluate. Beyond --limit the feedback is that of the limit.

    The folder given by --out receives orbit.json and orbit.png.

    \b
    The paper's scene:
      python -m training.orbits
    Another scene, with a picture:
      python -m training.orbits --scene paper_arms --out out/orbit
    A feedback about the orbit, compared with the controller alone:
      python -m training.orbits --scene paper --feedback out/paper.npz
      skate-env evaluate --scene paper --policy orbit=out/paper.npz --out out/evaluation
    An orbit of a learned policy's motion, and a feedback about it:
      python -m training.orbits --scene push_only --policy shipped --torque-weight 0.3 \\
        --feedback out/push_only.npz
    For programs:
      python -m training.orbits --scene mine.toml --json
    """  # noqa: D301 (\b keeps the examples' line breaks)
    with options.requires("train"):
        from . import chart, study
        from . import feedback as linear
    from skate_env.environments import TORQUE_SCALE
    from skate_env.scenes import replace

    try:
        if out is not None:
            prepare_folder(out)
        if feedback is not None:
            prepare_file(feedback)
        skated, learned = options.load_scene_and_policy(scene, policy)
        chosen = replace(skated, {"accuracy": options.value(accuracy)})
        found = study.study(chosen, lambda what: typer.echo(f"{what} ...", err=True), learned)
        if out is not None:
            chart.write(found, out)
        if feedback is not None:
            typer.echo("feedback ...", err=True)
            scale = TORQUE_SCALE if learned is None else learned.action_scale
            designed = linear.design(found.orbit, scale, weight=torque_weight, limit=limit)
            designed.save(feedback)
    except (ValueError, OSError) as error:
        options.fail(error)
    options.show(study.text(found), out, study.summary(found) if as_json else None)


if __name__ == "__main__":
    app()
