"""Lower bound of the cost of forward dynamics: straight-line arithmetic for the same tree.

Additions and multiplications from q, q' and tau to q'' are generated as C and compiled: without a
controller, contact states or loops over bodies.
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
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from skate_env._core import Scene, Simulator
from skate_env.scenes import load_scene
from skate_env.studies.timing import Block

from .c_source import c_source
from .straight_line import StraightLine, straight_line

Array = NDArray[np.float64]
Contact = Literal["flight", "sliding"]

# Compiler flags for any processor, and for the present one.
PORTABLE = ("-O3", "-fno-math-errno")
NATIVE = (*PORTABLE, "-march=native")


@dataclass(frozen=True)
class Flops:
    """Numbers of floating-point operations, counted by CasADi."""

    additions: int
    """Additions and subtractions."""
    multiplications: int
    divisions: int
    square_roots: int
    sines: int
    cosines: int

    @property
    def total(self) -> int:
        """All operations except sines and cosines."""
        return self.additions + self.multiplications + self.divisions + self.square_roots


def missing() -> str | None:
    """Describe a missing requirement; None if there is none."""
    if find_spec("casadi") is None:
        return "CasADi is not installed: pip install skate-env[bench]"
    if shutil.which(_compiler()[0]) is None:
        return f"there is no C compiler {_compiler()[0]}: install one or set CC"
    return None


class Compiled:
    """Forward dynamics of a scene's tree, compiled with the system's C compiler."""

    def __init__(
        self,
        scene: Scene | None = None,
        *,
        contact: Contact = "flight",
        flags: Sequence[str] = PORTABLE,
        lanes: int = 1,
    ) -> None:
        """Generate and compile the code.

        Parameters
        ----------
        scene
            Scene of the robot and gravity; the preset `paper` by default.
        contact
            ``"flight"``: no contact. ``"sliding"``: the supporting toe slides forward on the ice,
            with free y0 and q1.
        flags
            Compiler flags.
        lanes
            Number of environments in SIMD lanes: a power of 2.

        Raises
        ------
        RuntimeError
            If a requirement is missing or the compiler fails.
        ValueError
            If ``contact`` is ``"sliding"`` and the scene has no dry friction, or for other lanes.
        """
        if lack := missing():
            raise RuntimeError(lack)
        if lanes < 1 or lanes & (lanes - 1):
            raise ValueError(f"lanes = {lanes}: must be a power of 2")
        scene = load_scene("paper") if scene is None else scene
        simulator = Simulator(scene)
        gravity = float(json.loads(scene.to_json())["ice"]["gravity"])
        friction = None if contact == "flight" else -_friction(scene)
        line = straight_line(simulator, gravity, friction)
        self.shape = (len(simulator.coordinate_names), lanes)
        self.flops = _count(line)
        self.compiler, self.flags = _version(), tuple(flags)
        self._library = _compile(c_source(line, lanes), self.flags)

    def accelerations(self, q: Array, v: Array, tau: Array) -> Array:
        """Return the accelerations of all coordinates under torques and joint damping.

        All arrays are (n, lanes), with a column for each environment. Angles are up to 1e5 rad.
        """
        given = {"q": q, "v": v, "tau": tau}
        arguments = [self._checked(x, name) for name, x in given.items()]
        found = np.empty(self.shape)
        self._library.evaluate(*(x.ctypes.data for x in [*arguments, found]))
        return found

    def block(self, calls: int) -> Block:
        """Return a block of calls from random states, each depending on the previous one."""
        rng = np.random.default_rng(0)
        tau = rng.uniform(-100.0, 100.0, self.shape)

        def block() -> int:
            q, v = rng.uniform(-1.5, 1.5, self.shape), rng.uniform(-10.0, 10.0, self.shape)
            return int(self._library.repeat(calls, *(x.ctypes.data for x in (q, v, tau))))

        return block

    def _checked(self, x: Array, name: str) -> Array:
        x = np.ascontiguousarray(x, dtype=np.float64)
        if x.shape != self.shape:
            raise ValueError(f"{name} has shape {x.shape}: must be {self.shape}")
        return x


def _count(line: StraightLine) -> Flops:
    ca = import_module("casadi")
    found: Counter[int] = Counter()
    for function in (line.angles, line.accelerations):
        found.update(function.instruction_id(i) for i in range(function.n_instructions()))
    angles = line.angles.numel_out(0)
    return Flops(
        additions=found[ca.OP_ADD] + found[ca.OP_SUB],
        multiplications=found[ca.OP_MUL] + found[ca.OP_SQ] + found[ca.OP_TWICE],
        divisions=found[ca.OP_DIV] + found[ca.OP_INV],
        square_roots=found[ca.OP_SQRT],
        sines=angles,
        cosines=angles,
    )


def _friction(scene: Scene) -> float:
    """Return the coefficient of dry friction for forward sliding."""
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


def _compile(text: str, flags: Sequence[str]) -> ctypes.CDLL:
    with tempfile.TemporaryDirectory() as folder:
        source, library = Path(folder) / "dynamics.c", Path(folder) / "dynamics.so"
        source.write_text(text, encoding="utf-8")
        command = [*_compiler(), *flags, "-shared", "-fPIC", str(source), "-o", str(library)]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode != 0:
            raise RuntimeError(f"{shlex.join(command)} fails: {done.stderr.strip()}")
        # A loaded library does not need its file.
        loaded = ctypes.CDLL(str(library))
    loaded.repeat.restype = ctypes.c_longlong
    loaded.repeat.argtypes = [ctypes.c_longlong, *[ctypes.c_void_p] * 3]
    loaded.evaluate.restype = None
    loaded.evaluate.argtypes = [ctypes.c_void_p] * 4
    return loaded
