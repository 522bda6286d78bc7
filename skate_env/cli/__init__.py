"""The command ``skate-env``.

The module of a command holds its options and its help. Everything else is imported when the command
runs, so that ``--help`` is fast.
"""

import os
import signal
import sys
import threading
from contextlib import suppress
from importlib.metadata import version
from types import FrameType
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from .accuracy import accuracy
from .effects import effects
from .evaluate import evaluate
from .gait import gait
from .hardcases import hardcases
from .options import echo
from .record import record
from .replay import replay
from .scenes import scenes
from .train import train
from .view import view

GROUPS = {
    "Use": (replay, record, view, scenes, train, evaluate, gait),
    "Measure": (accuracy, effects, hardcases),
}


class Grouped(TyperGroup):
    """A command whose help lists its subcommands in groups."""

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Write the groups."""
        for heading, group in GROUPS.items():
            names = [command.__name__ for command in group]
            found = [(name, self.commands[name].get_short_help_str(80)) for name in names]
            with formatter.section(heading):
                formatter.write_dl(found)


app = typer.Typer(
    help="An ice-skating humanoid, simulated: the system of Zhang et al.",
    cls=Grouped,
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)


def _print_version(asked: bool) -> None:
    if asked:
        typer.echo(f"skate-env {version('skate-env')}")
        raise typer.Exit


@app.callback()
def prepare(
    _: Annotated[
        bool,
        typer.Option(
            "--version", callback=_print_version, is_eager=True, help="Print the version."
        ),
    ] = False,
) -> None:
    """Let SIGTERM raise SystemExit, so that unfinished files are removed."""
    if threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGTERM, _exit)


def _exit(number: int, _: FrameType | None) -> None:
    # The shell's status of a command that a signal has ended.
    raise SystemExit(128 + number)


for command in (command for group in GROUPS.values() for command in group):
    app.command()(command)


def main() -> None:
    """Run the command; an error of its output, as of a full disk, ends it with status 2."""
    # Figures are written to files; a backend that is not installed would be an error.
    os.environ["MPLBACKEND"] = "agg"
    try:
        app(prog_name="skate-env")
    except OSError as error:
        with suppress(OSError):
            echo(f"error: {error}", err=True)
        sys.exit(2)
    finally:
        _drop_output()


def _drop_output() -> None:
    """Drop what cannot be written, or Python would fail to write it once more at its end."""
    try:
        if sys.stdout is not None:
            sys.stdout.flush()
    except OSError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
