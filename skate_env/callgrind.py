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
from pathlib import Path

from . import _callgrind_worker, _core
from ._core import Scene

# Only what happens inside `Simulator.step` counts, and every call gets a file of its own.
_STEP = "*__pymethod_step__"


class Unavailable(Exception):
    """Why something cannot be measured here."""


def instructions_per_evaluation(
    scenes: Sequence[Scene],
    progress: Callable[[], object] = lambda: None,
    engine: str | Path = _core.__file__,
) -> list[float]:
    """Count the instructions of one action period from each scene's start.

    They are divided by the right-hand sides evaluated, all that the engine does in between
    included: controller, error control, guards, impacts. ``progress`` is called after each scene;
    ``engine`` is the compiled module, by default the one in use.

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
        command = [
            *(valgrind, "-q", "--tool=callgrind", f"--callgrind-out-file={out}"),
            *("--collect-atstart=no", f"--toggle-collect={_STEP}", f"--dump-after={_STEP}"),
            *(sys.executable, "-I", "-S", _callgrind_worker.__file__, str(engine)),
        ]
        work = Path(folder) / "scenes"
        lines = [json.dumps(json.loads(scene.to_json())) for scene in scenes]
        work.write_text("".join(line + "\n" for line in lines), encoding="utf-8")
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
        if process.returncode != 0 or len(evaluations) != len(scenes):
            said = errors.read_text(encoding="utf-8", errors="replace").strip().splitlines()
            raise Unavailable(f"valgrind fails: {said[-1] if said else process.returncode}")
        dumps = [Path(f"{out}.{number}") for number in range(1, len(scenes) + 1)]
        if not all(dump.exists() for dump in dumps):
            raise Unavailable("callgrind does not see the engine, whose symbols are stripped")
        return [_total(dump) / count for dump, count in zip(dumps, evaluations, strict=True)]


def _total(dump: Path) -> int:
    """Read the instructions in a file that callgrind wrote."""
    with dump.open(encoding="utf-8", errors="replace") as file:
        for line in file:
            if line.startswith("totals:"):
                return int(line.split()[1])
    raise Unavailable("callgrind left a file without totals")
