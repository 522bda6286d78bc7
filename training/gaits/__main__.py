"""``python -m training.gaits``: the cards of gaits, beside what the paper and a human require."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

from skate_env import Simulator
from skate_env.cli import options
from skate_env.cli.options import MOST_STEPS, path
from skate_env.common import files, prepare_folder, progress_bar
from skate_env.gait import Motion, report, skate
from skate_env.scenes import load_scene, replace
from skate_env.studies.report import Heading, Part, Table, markdown, text

from .limits import HUMAN, LINES, ONE, REQUIRED, Limit
from .robustness import ACCURACIES, SIGMA, STARTS, Robustness, measure

NOTE = """\
An asterisk marks a value that does not meet the requirement on the paper's gait; the other limits
are those of a human."""
# Values of the runs: name, definition, requirement.
MADE = "share of steps made"
RUNS = {
    "survived": (
        "share of perturbed starts that make all steps",
        f"of {STARTS} starts, perturbed by {SIGMA:g} (`Simulator.perturb`), at balanced",
        None,
    ),
    "at_least": ("the same, at least", "lower end of Wilson's interval of 95 %", Limit(0.9)),
    "at_most": ("the same, at most", "upper end of this interval", None),
    "in_order": ("share of their steps in the order", "share of the complete ones", None),
    "in_order_standing": (
        "the same of these steps with state 1 counted as state 3",
        "state 1 (supporting foot sticks) counts as state 3 (it slides)",
        None,
    ),
}
app = typer.Typer(add_completion=False, pretty_exceptions_enable=False, rich_markup_mode=None)


@dataclass(frozen=True)
class Card:
    """A motion, and the runs of other accuracies and starts."""

    motion: Motion
    runs: Robustness


def card(scene: str, steps: int) -> Card:
    """Measure the gait of a scene over up to ``steps`` steps.

    Raises
    ------
    ValueError
        If there is no such scene.
    """
    chosen = replace(load_scene(scene), {"accuracy": "balanced"})
    with progress_bar(steps + STARTS, scene, "run") as bar:
        motion = skate(Simulator(chosen), steps, progress=bar.update)
        bar.update(steps - motion.recording.steps.size)
        return Card(motion, measure(chosen, steps, bar.update))


def table(cards: Mapping[str, Card]) -> Table:
    """Tabulate all lines: requirements, then a column for each card."""
    rows = []
    for line in LINES:
        values = [line.measure(card.motion) for card in cards.values()]
        limits = REQUIRED.get(line.key), HUMAN.get(line.key)
        rows.append(_row(line.title, limits, values))
    for accuracy in ACCURACIES:
        values = [card.runs.made[accuracy] for card in cards.values()]
        rows.append(_row(f"{MADE}, {accuracy}", (ONE, None), values))
    for key, (name, _, required) in RUNS.items():
        values = [getattr(card.runs, key) for card in cards.values()]
        rows.append(_row(name, (required, None), values))
    return Table("", ["", "required", "human", *cards], rows)


def _row(title: str, limits: tuple[Limit | None, Limit | None], values: list[float]) -> list[str]:
    required, _ = limits
    marks = ["*" if required and not required.met(value) else "" for value in values]
    cells = [report.number(value) + mark for value, mark in zip(values, marks, strict=True)]
    return [title, *("" if limit is None else str(limit) for limit in limits), *cells]


def definitions() -> Table:
    """Tabulate what each line is."""
    rows = [[line.name, line.unit, line.definition] for line in LINES]
    rows.append([MADE, "1", "share of the steps asked for, from the scene's own start"])
    rows += [[name, "1", definition] for name, definition, _ in RUNS.values()]
    return Table("", ["line", "unit", "definition"], rows)


def document(cards: Mapping[str, Card], command: str) -> str:
    """Lay cards out for a document, beside the pictures of the gaits."""
    head = ["# Cards of gaits", f"Written by `{command}`.", report.RULE, report.SCOPE, NOTE]
    parts: list[Part] = [*head, table(cards)]
    for name, card in cards.items():
        sequences = report.sequences(name, card.motion).replace("\n  ", "\n- ")
        parts += [Heading(name, 2), sequences]
        if card.motion.orders:
            parts.append(f"![One step of {name}]({report.picture(name)})")
    return markdown([*parts, Heading("Definitions", 2), definitions()])


@app.command()
def main(
    scene: Annotated[
        list[str], typer.Option(help="Name of a preset, or a .toml file; may be repeated.")
    ],
    steps: Annotated[int, typer.Option(min=2, max=MOST_STEPS, help="Number of gait steps.")] = 100,
    out: Annotated[
        Path | None,
        typer.Option(parser=path, help="Folder for gaits.md and pictures; created if missing."),
    ] = None,
) -> None:
    """Measure gaits beside what the paper and a human require.

    Adds to the lines of skate-env gait: how the free foot lands, how far the centre of pressure
    leaves the soles, lift on the head, work of tau1, the steps at the accuracies 1e-7 and
    reference, and the share of perturbed starts that make all steps.

    \b
    The presets, as in docs/generated/gaits.md:
      make gaits
    The result of a search:
      python -m training.gaits --scene mine.toml
    """  # noqa: D301 (\b keeps the examples' line breaks)
    try:
        if out is not None:
            prepare_folder(out)
        cards = {load_scene(each).name: card(each, steps) for each in scene}
        if out is not None:
            command = "python -m training.gaits" + "".join(f" --scene {each}" for each in scene)
            page = document(cards, f"{command} --steps {steps}").encode()
            pictures = report.pictures({name: card.motion for name, card in cards.items()}, out)
            files.write_all(pictures | {out / "gaits.md": page})
    except (ValueError, OSError) as error:
        options.fail(error)
    options.show(text([report.RULE, report.SCOPE, NOTE, table(cards)]), out, None)


if __name__ == "__main__":
    app()
