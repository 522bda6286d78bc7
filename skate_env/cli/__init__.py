"""The command ``skate-env``.

The module of a command holds its options and its help. Everything else is imported when the command
runs, so that ``--help`` is fast.
"""

import os
import signal
import sys
import threading
from contextlib import suppress
from types import FrameType

import typer

from .accuracy import accuracy
from .bench import bench
from .effects import effects
from .evaluate import evaluate
from .gait import gait
from .hardcases import hardcases
from .orbit import orbit
from .record import record
from .replay import replay
from .scenes import scenes
from .sensitivity import sensitivity
from .soak import soak
from .stress import stress
from .train import train
from .view import view

app = typer.Typer(
    help="An ice-skating humanoid, simulated: the system of Zhang et al.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)


@app.callback()
def handle_termination() -> None:
    """Let SIGTERM raise SystemExit, so that unfinished files are removed."""
    if threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGTERM, _exit)


def _exit(number: int, _: FrameType | None) -> None:
    # The shell's status of a command that a signal has ended.
    raise SystemExit(128 + number)


for command in (
    *(replay, record, view, scenes, train, evaluate),
    *(gait, orbit, sensitivity, accuracy, bench, effects, hardcases, stress, soak),
):
    app.command()(command)


def main() -> None:
    """Run the command; an error of its output, as of a full disk, ends it with status 2."""
    try:
        app(prog_name="skate-env")
    except OSError as error:
        with suppress(OSError):
            typer.echo(f"error: {error}", err=True)
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
