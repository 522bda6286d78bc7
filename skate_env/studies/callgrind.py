"""Instruction counts of the engine by valgrind's callgrind.

Counts do not depend on the load of the machine. They repeat exactly in the same process environment
and to 1e-3 in others, where memory has other addresses.
"""

import json
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from .. import _core
from .._core import Scene
from . import _callgrind_worker

# Callgrind counts inside this method of `Simulator` and writes a file for every call. It accepts
# one pattern.
_METHOD = "*__pymethod_{}__"


class Unavailable(Exception):
    """Instructions cannot be counted on this machine."""


@dataclass(frozen=True)
class Run:
    """A motion from a scene's start."""

    scene: Scene
    until: float | None = None
    """End of the motion [s]; None for one action period, in all runs of a call or in none."""
    torque: Sequence[float] | None = None
    """Constant joint torques [N m]."""


@dataclass(frozen=True)
class Count:
    """Counts of a run."""

    instructions: int
    evaluations: int
    """Evaluations of the right-hand side."""


def instructions_per_evaluation(
    scenes: Sequence[Scene],
    progress: Callable[[], object] = lambda: None,
    engine: str | Path = _core.__file__,
) -> list[float]:
    """Count the instructions of one action period from each scene's start.

    They include controller, error control, guards and impacts, and are divided by the number of
    evaluations of the right-hand side. The other arguments and exceptions are those of `count`.
    """
    counts = count([Run(scene) for scene in scenes], progress, engine)
    return [each.instructions / each.evaluations for each in counts]


def count(
    runs: Sequence[Run],
    progress: Callable[[], object] = lambda: None,
    engine: str | Path = _core.__file__,
) -> list[Count]:
    """Count the instructions of each run.

    ``progress`` is called after each; ``engine`` is the compiled module, by default the one in use.

    Raises
    ------
    Unavailable
        If valgrind is not installed or cannot run the engine.
    """
    valgrind = shutil.which("valgrind")
    if valgrind is None:
        raise Unavailable("valgrind is not installed")
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "callgrind"
        stepping = all(run.until is None for run in runs)
        method = _METHOD.format("step" if stepping else "advance")
        command = [
            *(valgrind, "-q", "--tool=callgrind", f"--callgrind-out-file={out}"),
            "--collect-atstart=no",
            *(f"--toggle-collect={method}", f"--dump-after={method}"),
            *(sys.executable, "-I", "-S", _callgrind_worker.__file__, str(engine)),
            str(Path(np.__file__).parents[1]),
        ]
        work = Path(folder) / "runs"
        work.write_text("".join(_line(run) + "\n" for run in runs), encoding="utf-8")
        errors = Path(folder) / "errors"
        evaluations = []
        with (
            work.open(encoding="utf-8") as stdin,
            errors.open("w", encoding="utf-8") as stderr,
            subprocess.Popen(
                command, stdin=stdin, stdout=subprocess.PIPE, stderr=stderr, text=True
            ) as process,
        ):
            assert process.stdout is not None
            try:
                for line in process.stdout:
                    evaluations.append(int(line.split()[0]))
                    progress()
            except BaseException:
                # Otherwise valgrind would run to its end.
                process.kill()
                raise
        if process.returncode != 0 or len(evaluations) != len(runs):
            said = errors.read_text(encoding="utf-8", errors="replace").strip().splitlines()
            raise Unavailable(f"valgrind fails: {said[-1] if said else process.returncode}")
        dumps = [Path(f"{out}.{number}") for number in range(1, len(runs) + 1)]
        if not all(dump.exists() for dump in dumps):
            raise Unavailable("callgrind cannot find the engine: its symbols are stripped")
        totals = map(_total, dumps)
        return [Count(*each) for each in zip(totals, evaluations, strict=True)]


def _line(run: Run) -> str:
    """Format a run for the worker."""
    torque = None if run.torque is None else list(run.torque)
    scene = json.dumps(json.loads(run.scene.to_json()))
    return json.dumps({"scene": scene, "until": run.until, "torque": torque})


def _total(dump: Path) -> int:
    """Read the number of instructions from a file of callgrind."""
    with dump.open(encoding="utf-8", errors="replace") as file:
        for line in file:
            if line.startswith("totals:"):
                return int(line.split()[1])
    raise Unavailable("a file of callgrind has no totals")
