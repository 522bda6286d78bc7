"""The study: errors and costs of the Jacobians of actions from random starts."""

from collections.abc import Callable, Hashable
from dataclasses import dataclass, field

import numpy as np

from skate_env.studies.motions.cases import STARTS, Array, Case, cases
from skate_env.studies.motions.mujoco_model import ELLIPTIC, PYRAMIDAL, Setting
from skate_env.studies.report import EMPTY, Table
from tests.differences import difference

from .actions import COARSE, FINE, Action, EngineAction, MujocoAction

MOTIONS = ("slide", "landing")
"""Motions of the accuracy study with contact and without controller."""
STEP = 0.001
"""MuJoCo's timestep [s]."""

Maker = Callable[[Case, np.random.Generator, int], Action]


def engines(motion: str) -> dict[str, Maker]:
    """All engines and settings by label."""
    best = {"slide": "gliding", "landing": "firm"}[motion]

    def mujoco(cone: str, contact: str, epsilon: float) -> Maker:
        setting = Setting("Euler", STEP, cone, contact)
        return lambda case, rng, start: MujocoAction(case, rng, start, setting, epsilon)

    made: dict[str, Maker] = {"IceSkate": EngineAction}
    for cone, contact in ((PYRAMIDAL, "default"), (ELLIPTIC, best)):
        for epsilon in (COARSE, FINE):
            label = f"MuJoCo, contact `{contact}`, displacement {epsilon:g}"
            made[label] = mujoco(cone, contact, epsilon)
    return made


@dataclass
class Errors:
    """Errors of one engine: relative to the largest entry of the product or 1."""

    smooth: list[float] = field(default_factory=list)
    with_events: list[float] = field(default_factory=list)
    unknown: int = 0
    """Starts at which every displacement changes the sequence of events, or the difference has a
    larger error than the derivative."""
    flagged: int = 0
    """Starts at which the engine names a reason why the derivative may not exist."""
    costs: list[float] = field(default_factory=list)
    """Time of the Jacobian divided by that of the action."""


def measure(motion: str, label: str, starts: int, seed: int = 0) -> Errors:
    """Compare products with random directions, each start with one."""
    case, make, errors = cases()[motion], engines(motion)[label], Errors()
    rng = np.random.default_rng(seed)
    for start in range(starts):
        action = make(case, rng, start % STARTS)
        try:
            A, spent, moved = action.jacobian()
        except ValueError:  # A fall.
            continue
        errors.costs.append(spent / moved)
        if action.is_flagged():
            errors.flagged += 1
            continue
        dx = rng.normal(size=len(A))

        def end(e: float, action: Action = action, dx: Array = dx) -> tuple[Array, Hashable]:
            return action.end(e * dx)

        found = difference(end, noise=action.noise)
        scale = max(1.0, float(np.abs(A @ dx).max()))
        if found is None:
            errors.unknown += 1
            continue
        error = float(np.abs(found[0] - A @ dx).max())
        if error < found[1] and found[1] > 1e-6 * scale:
            errors.unknown += 1
            continue
        (errors.with_events if action.has_events() else errors.smooth).append(error / scale)
    return errors


def table(starts: int) -> str:
    """Measure everything and write it as Markdown."""
    changes = ("without changes: median, largest", "with changes: median, largest")
    head = ("motion", "engine", *changes, "no truth", "flagged", "cost")
    rows = []
    for motion in MOTIONS:
        for label in engines(motion):
            e = measure(motion, label, starts)
            counts = (f"{e.unknown}", f"{e.flagged}", f"{np.median(e.costs):.0f}")
            rows.append((motion, label, _cell(e.smooth), _cell(e.with_events), *counts))
    return Table("", head, rows).markdown()


def _cell(errors: list[float]) -> str:
    if not errors:
        return EMPTY
    return f"{np.median(errors):.0e}, {max(errors):.1e} ({len(errors)})"
