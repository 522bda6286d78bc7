"""The arithmetic floor: what forward dynamics of the same tree cost with nothing around them.

A straight line of additions and multiplications from q, q' and tau to q'', written as C and
compiled here: no controller, no choice of contacts, no loop over bodies.
"""

import ctypes
import json
import os
import shlex
import shutil
import subprocess
import tempfile
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from tqdm import trange

from .._core import Scene, Simulator
from ..scenes import load_scene
from ..timing import Block, interleaved
from .straight_line import accelerations

Array = NDArray[np.float64]
Contact = Literal["flight", "sliding"]

# As a compiled package is for any machine, and for this very one.
PORTABLE = ("-O3", "-fno-math-errno")
NATIVE = (*PORTABLE, "-march=native")

# Each call needs what the last one found, as an integrator's do. The step [s] is too short to get
# anywhere.
_TIMER = """
#include <time.h>
static void call(const double* q, const double* v, const double* tau, double* a) {
  const double* in[3] = {q, v, tau};
  double* out[1] = {a};
  accelerations(in, out, 0, 0, 0);
}
void evaluate(const double* q, const double* v, const double* tau, double* a) {
  call(q, v, tau, a);
}
long long repeat(long long times, double* q, double* v, const double* tau) {
  struct timespec begun, ended;
  double a[N];
  clock_gettime(CLOCK_MONOTONIC, &begun);
  for (long long i = 0; i < times; i++) {
    call(q, v, tau, a);
    for (int k = 0; k < N; k++) { q[k] += 1e-12 * v[k]; v[k] += 1e-12 * a[k]; }
  }
  clock_gettime(CLOCK_MONOTONIC, &ended);
  return 1000000000LL * (ended.tv_sec - begun.tv_sec) + ended.tv_nsec - begun.tv_nsec;
}
"""
# Calls in a block, which then takes some 0.1 ms, and blocks.
_CALLS, _ROUNDS = 200, 300


@dataclass(frozen=True)
class Flops:
    """Operations on numbers, each kind as CasADi counts it."""

    additions: int
    """And subtractions."""
    multiplications: int
    divisions: int
    square_roots: int
    sines: int
    cosines: int

    @property
    def total(self) -> int:
        """All but sines and cosines."""
        return self.additions + self.multiplications + self.divisions + self.square_roots


@dataclass(frozen=True)
class Floor:
    """What one evaluation takes."""

    contact: Contact
    flops: Flops
    nanoseconds: float
    compiler: str
    flags: tuple[str, ...]


def missing() -> str | None:
    """Say what the floor cannot be measured without, or None."""
    if find_spec("casadi") is None:
        return "CasADi is not installed: pip install skate-env[bench]"
    if shutil.which(_compiler()[0]) is None:
        return f"there is no C compiler {_compiler()[0]}: install one or name it in CC"
    return None


def measure(
    scene: Scene | None = None,
    *,
    contact: Contact = "flight",
    flags: Sequence[str] = PORTABLE,
    rounds: int = _ROUNDS,
) -> Floor | None:
    """Count and time forward dynamics; None where `missing` says what is missing.

    Arguments are those of `StraightLine`; ``rounds`` is the number of blocks whose least time
    counts.
    """
    if missing() is not None:
        return None
    if rounds < 1:
        raise ValueError(f"rounds = {rounds}: must be at least 1")
    line = StraightLine(scene, contact=contact, flags=flags)
    with trange(rounds, desc=f"floor, {contact}", leave=False) as bar:
        [times] = interleaved([line.block(_CALLS)], rounds, bar.update)
    nanoseconds = 1e9 * float(np.nanmin(times)) / _CALLS
    return Floor(contact, line.flops, nanoseconds, line.compiler, line.flags)


class StraightLine:
    """Forward dynamics of a scene's tree, compiled by the system's C compiler."""

    def __init__(
        self,
        scene: Scene | None = None,
        *,
        contact: Contact = "flight",
        flags: Sequence[str] = PORTABLE,
    ) -> None:
        """Generate and compile.

        Parameters
        ----------
        scene
            Whose robot and gravity; the preset `paper` by default.
        contact
            ``"flight"``: nothing touches the ice. ``"sliding"``: the toe of the supporting foot
            slides forward on it, y0 and q1 being free.
        flags
            Of the compiler.

        Raises
        ------
        RuntimeError
            If something is missing, or the compiler fails.
        ValueError
            If a foot is to slide where the scene has no dry friction.
        """
        if lack := missing():
            raise RuntimeError(lack)
        scene = load_scene("paper") if scene is None else scene
        simulator = Simulator(scene)
        gravity = float(json.loads(scene.to_json())["ice"]["gravity"])
        friction = None if contact == "flight" else -_friction(scene)
        function = accelerations(simulator, gravity, friction)
        self.n = len(simulator.coordinate_names)
        self.flops = _count(function)
        self.compiler, self.flags = _version(), tuple(flags)
        self._library = _compile(function, self.n, self.flags)

    def accelerations(self, q: Array, v: Array, tau: Array) -> Array:
        """Accelerations (n,) of all coordinates under applied torques, joint friction added."""
        given = {"q": q, "v": v, "tau": tau}
        arguments = [_vector(x, self.n, name) for name, x in given.items()]
        found = np.empty(self.n)
        self._library.evaluate(*(x.ctypes.data for x in [*arguments, found]))
        return found

    def block(self, calls: int) -> Block:
        """Make a block of calls from random states, each needing what the last one found."""
        rng = np.random.default_rng(0)
        tau = rng.uniform(-100.0, 100.0, self.n)

        def block() -> int:
            q, v = rng.uniform(-1.5, 1.5, self.n), rng.uniform(-10.0, 10.0, self.n)
            return int(self._library.repeat(calls, *(x.ctypes.data for x in (q, v, tau))))

        return block


def _count(function: Any) -> Flops:
    ca = import_module("casadi")
    found = Counter(function.instruction_id(i) for i in range(function.n_instructions()))
    return Flops(
        additions=found[ca.OP_ADD] + found[ca.OP_SUB],
        multiplications=found[ca.OP_MUL] + found[ca.OP_SQ] + found[ca.OP_TWICE],
        divisions=found[ca.OP_DIV] + found[ca.OP_INV],
        square_roots=found[ca.OP_SQRT],
        sines=found[ca.OP_SIN],
        cosines=found[ca.OP_COS],
    )


def _friction(scene: Scene) -> float:
    """Coefficient of dry friction that pulls a foot back which slides forward."""
    friction = json.loads(scene.to_json())["ice"]["friction"]
    for name in ("mu_forward", "mu"):
        if name in friction:
            return float(friction[name])
    raise ValueError(f"scene {scene.name} has {friction['kind']} friction: must be dry")


def _compiler() -> list[str]:
    return shlex.split(os.environ.get("CC") or "cc")


def _version() -> str:
    found = subprocess.run([*_compiler(), "--version"], capture_output=True, text=True, check=False)
    return found.stdout.partition("\n")[0]


def _compile(function: Any, n: int, flags: Sequence[str]) -> ctypes.CDLL:
    generator = import_module("casadi").CodeGenerator("floor.c")
    generator.add(function)
    with tempfile.TemporaryDirectory() as folder:
        source, library = Path(folder) / "floor.c", Path(folder) / "floor.so"
        source.write_text(generator.dump() + _TIMER, encoding="utf-8")
        command = [*_compiler(), *flags, f"-DN={n}", "-shared", "-fPIC"]
        command += [str(source), "-o", str(library), "-lm"]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode != 0:
            raise RuntimeError(f"{shlex.join(command)} fails: {done.stderr.strip()}")
        # What is loaded stays when its file goes.
        loaded = ctypes.CDLL(str(library))
    loaded.repeat.restype = ctypes.c_longlong
    loaded.repeat.argtypes = [ctypes.c_longlong, *[ctypes.c_void_p] * 3]
    loaded.evaluate.restype = None
    loaded.evaluate.argtypes = [ctypes.c_void_p] * 4
    return loaded


def _vector(x: Array, n: int, name: str) -> Array:
    x = np.ascontiguousarray(x, dtype=np.float64)
    if x.shape != (n,):
        raise ValueError(f"{name} has shape {x.shape}: must be ({n},)")
    return x
