"""The command ``skate-env orbit``: the periodic orbit of a gait."""

from pathlib import Path
from typing import Annotated

import typer

from . import options
from .options import JsonOption, SceneOption, number


def orbit(
    scene: SceneOption = "paper",
    accuracy: Annotated[
        str, typer.Option(help="balanced, reference, a relative tolerance, or JSON.")
    ] = "reference",
    out: Annotated[
        Path | None, typer.Option(help="Folder for text and picture; created if missing.")
    ] = None,
    policy: Annotated[
        Path | None, typer.Option(help="File for a linear feedback about the orbit.")
    ] = None,
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

    With --policy it designs a feedback in residual torques by the periodic Riccati equation, and
    writes it to a file for skate-env evaluate. Beyond --limit the feedback is that of the limit.

    The folder given by --out receives orbit.md, orbit.json and orbit.png.

    \b
    The paper's scene:
      skate-env orbit
    Another scene, with a picture:
      skate-env orbit --scene paper_arms --out out/orbit
    A feedback about the orbit, compared with the controller alone:
      skate-env orbit --scene paper --policy out/paper.npz
      skate-env evaluate --scene paper --policy orbit=out/paper.npz --out out/evaluation
    For programs:
      skate-env orbit --scene mine.toml --json
    """  # noqa: D301 (\b keeps the examples' line breaks)
    with options.requires("train"):
        from ..studies.orbit import feedback, report, study
    from ..scenes import load_scene, replace

    try:
        if out is not None:
            out.mkdir(parents=True, exist_ok=True)
        chosen = replace(load_scene(scene), {"accuracy": options.value(accuracy)})
        found = study.study(chosen, lambda what: typer.echo(f"{what} ...", err=True))
        if out is not None:
            report.write(found, out, f"skate-env orbit --scene {scene} --accuracy {accuracy}")
        if policy is not None:
            typer.echo("feedback ...", err=True)
            feedback.design(found.orbit, limit).save(policy)
    except (ValueError, OSError) as error:
        options.fail(error)
    options.show(report.text(found), out, report.summary(found) if as_json else None)
