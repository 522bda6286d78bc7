"""Instructions that the engine executes, counted by valgrind's callgrind.

Such a count does not depend on the machine's load. It repeats exactly in the same surroundings and
to 1e-3 in others, as memory then lies elsewhere.
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

# Only what happens inside this method of `Simulator` counts, and every call gets a file of its own;
# callgrind heeds one pattern only.
_METHOD = "*__pymethod_{}__"


class Unavailable(Exception):
    """Why something cannot be measured here."""


@dataclass(frozen=True)
class Run:
    """A motion from a scene's start."""

    scene: Scene
    until: float | None = None
    """Its end [s]; None for one action period, in all runs that are counted together or in none."""
    torque: Sequence[float] | None = None
    """Held at the joints [N m]."""


@dataclass(frozen=True)
class Count:
    """What a run took."""

    instructions: int
    evaluations: int
    """Of the right-hand side."""


def instructions_per_evaluation(
    scenes: Sequence[Scene],
    progress: Callable[[], object] = lambda: None,
    engine: str | Path = _core.__file__,
) -> list[float]:
    """Count the instructions of one action period from each scene's start.

    They are divided by the right-hand sides evaluated, all that the engine does in between
    included: controller, error control, guards, impacts. The other arguments, and what is raised,
    are those of `count`.
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
        If valgrind is not installed, or cannot follow the engine.
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
            for line in process.stdout:
                evaluations.append(int(line.split()[0]))
                progress()
        if process.returncode != 0 or len(evaluations) != len(runs):
            said = errors.read_text(encoding="utf-8", errors="replace").strip().splitlines()
            raise Unavailable(f"valgrind fails: {said[-1] if said else process.returncode}")
        dumps = [Path(f"{out}.{number}") for number in range(1, len(runs) + 1)]
        if not all(dump.exists() for dump in dumps):
            raise Unavailable("callgrind does not see the engine, whose symbols are stripped")
        totals = map(_total, dumps)
        return [Count(*each) for each in zip(totals, evaluations, strict=True)]


def _line(run: Run) -> str:
    """Write a run as the worker reads it."""
    torque = None if run.torque is None else list(run.torque)
    scene = json.dumps(json.loads(run.scene.to_json()))
    return json.dumps({"scene": scene, "until": run.until, "torque": torque})


def _total(dump: Path) -> int:
    """Read the instructions in a file that callgrind wrote."""
    with dump.open(encoding="utf-8", errors="replace") as file:
        for line in file:
            if line.startswith("totals:"):
                return int(line.split()[1])
    raise Unavailable("callgrind left a file without totals")
