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
from pathlib import Path

import numpy as np

from .. import _core
from .._core import Scene
from . import _callgrind_worker

# Callgrind counts inside this method of `Simulator` and writes a file for every call.
_METHOD = "*__pymethod_step__"


class Unavailable(Exception):
    """Instructions cannot be counted on this machine."""


def instructions_per_evaluation(
    scenes: Sequence[Scene],
    progress: Callable[[], object] = lambda: None,
    engine: str | Path = _core.__file__,
) -> list[float]:
    """Count the instructions of one action period from each scene's start.

    They include controller, error control, guards and impacts, and are divided by the number of
    evaluations of the right-hand side. ``progress`` is called after each scene; ``engine`` is the
    compiled module, by default the one in use.

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
        command = [
            *(valgrind, "-q", "--tool=callgrind", f"--callgrind-out-file={out}"),
            "--collect-atstart=no",
            *(f"--toggle-collect={_METHOD}", f"--dump-after={_METHOD}"),
            *(sys.executable, "-I", "-S", _callgrind_worker.__file__, str(engine)),
            str(Path(np.__file__).parents[1]),
        ]
        work = Path(folder) / "scenes"
        lines = (json.dumps(scene.to_json()) + "\n" for scene in scenes)
        work.write_text("".join(lines), encoding="utf-8")
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
                    evaluations.append(int(line))
                    progress()
            except BaseException:
                # Otherwise valgrind would run to its end.
                process.kill()
                raise
        if process.returncode != 0 or len(evaluations) != len(scenes):
            output = errors.read_text(encoding="utf-8", errors="replace").strip().splitlines()
            raise Unavailable(f"valgrind fails: {output[-1] if output else process.returncode}")
        dumps = [Path(f"{out}.{number}") for number in range(1, len(scenes) + 1)]
        if not all(dump.exists() for dump in dumps):
            raise Unavailable("callgrind cannot find the engine: its symbols are stripped")
        counts = map(_total, dumps)
        return [count / each for count, each in zip(counts, evaluations, strict=True)]


def _total(dump: Path) -> int:
    """Read the number of instructions from a file of callgrind."""
    with dump.open(encoding="utf-8", errors="replace") as file:
        for line in file:
            if line.startswith("totals:"):
                return int(line.split()[1])
    raise Unavailable("a file of callgrind has no totals")
