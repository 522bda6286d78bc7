"""The search of `gradients`.

The unknowns are the parameters of the scene; the cycle follows from them, because it stays closed
(`cycle`). Each iteration solves a linear program: the distances of the card from its limits
as in `score`, linearised, in a box, subject to the multipliers' bound.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from itertools import zip_longest

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linprog

from skate_env import Scene, Simulator
from skate_env.gait import ONLY_FIRST, SIGMA, skate
from skate_env.replay import record
from skate_env.scenes import replace

from .cycle import Cycle, Linear, Point, moved
from .score import TERMS, distance
from .variables import Group, changed, variables

Array = NDArray[np.float64]

# Time between samples of forces and torques [s]; the card's is 1 ms.
FINE = 2.5e-4
# Of the multipliers' moduli, and of the toe's depth at the landing [mm].
BOUND, MARGIN = 0.98, 6.0
# Terms of the score that are constant in a sequence of contact states.
_DISCRETE = ("order", "in_order", "time_in_15", "swap_from_14")
# Least time in each state of the sequence [ms].
_DWELL = 4.0
# Height of the toe at the landing, whose sign decides which end lands.
_TOE = "landing_toe"
# Step of the differences, least and largest half-width of the box [units of variables].
_STEP, _LEAST, _LARGEST = 0.05, 2e-3, 1.0
# Multipliers below this are not bounded. Distance of one from 1 that is the orbit's own.
_SMALL, _OWN = 0.5, 1e-2
# Part of the predicted decrease that an iteration must make; factors of the box.
_DECREASE, _SHRINK, _GROW = 0.05, 0.4, 2.0
# Weights of a multiplier above its bound.
_ELASTIC, _PENALTY = 1e3, 10.0
# Gait steps that a perturbed start must make.
_STEPS = 100


class Stability(str, Enum):
    """How the multipliers are bounded."""

    none = "none"
    constraint = "constraint"
    penalty = "penalty"


@dataclass(frozen=True)
class Gait:
    """A closed cycle, and what its card says.

    Attributes
    ----------
    point
        On the cycle.
    values
        By name of the term, and the time in each state as "state N" [ms].
    sequence
        Contact states.
    multipliers
        Without that of the orbit's own direction.
    """

    point: Point
    values: Mapping[str, float]
    sequence: tuple[int, ...]
    multipliers: NDArray[np.complex128]

    @property
    def radius(self) -> float:
        """Largest modulus of the multipliers."""
        return float(np.abs(self.multipliers).max())


class Search:
    """Gaits near that of a scene.

    Parameters
    ----------
    scene
        Whose start leads to the gait.
    weights, human
        As for `score.score`.
    stability, bound
        Of the multipliers.
    margin
        Least depth of the free toe at the landing, where it is below the ice [mm].
    starts
        Number of perturbed starts that must make 100 steps.
    """

    def __init__(
        self,
        scene: Scene,
        weights: Mapping[str, float],
        human: bool,
        stability: Stability = Stability.constraint,
        bound: float = BOUND,
        margin: float = MARGIN,
        starts: int = 0,
    ) -> None:
        self._given, self._starts = scene, starts
        self.scene = replace(scene, {"control.action_period": FINE})
        self.variables = variables(scene, [Group.start])
        self.x = np.zeros(len(self.variables))
        self._stability, self._bound, self._margin = stability, bound, margin
        names = [name for name in TERMS if name not in _DISCRETE]
        self._limits = {name: TERMS[name].limit(human) for name in names}
        self._weights = {name: weights.get(name, 1.0) * TERMS[name].weight for name in names}
        self._fields = sorted({name for each in self.variables for name in each.fields})
        cycle = Cycle(self.scene)
        self.gait = self._measure(cycle, *cycle.close(cycle.found())[:2])

    def at(self, x: Array) -> Scene:
        """Return the scene with ``x`` units of the variables added."""
        return changed(self.scene, self.variables, x)

    def score(self, gait: Gait) -> float:
        """Return the weighted sum of the distances from the limits."""
        return float(
            sum(
                weight * distance(gait.values[name], self._limits[name]) / TERMS[name].unit
                for name, weight in self._weights.items()
            )
        )

    def merit(self, gait: Gait) -> float:
        """Return the score, with the multipliers above their bound."""
        above = np.maximum(np.abs(gait.multipliers) - self._bound, 0.0).sum()
        return self.score(gait) + self._cost_of_excess * float(above)

    @property
    def _cost_of_excess(self) -> float:
        costs = {Stability.constraint: _ELASTIC, Stability.penalty: _PENALTY}
        return costs.get(self._stability, 0.0)

    def iterate(self, box: float) -> tuple[float, str]:
        """Improve the gait in a box; return the next box, and why larger ones failed."""
        tangent = self._tangent()
        slopes, by_multiplier = self._slopes(tangent)
        reasons: list[str] = []
        while box > _LEAST:
            dx, predicted = self._program(slopes, by_multiplier, box)
            try:
                new = self._gait(self.x + dx, tangent)
                self._require(self.x + dx, new, predicted)
                self.gait, self.x = new, self.x + dx
                return min(_GROW * box, _LARGEST), "; ".join(reasons)
            except ValueError as error:
                reasons.append(f"{box:.2g}: {error}")
            box *= _SHRINK
        return 0.0, "; ".join(reasons)

    def _measure(self, cycle: Cycle, point: Point, linear: Linear) -> Gait:
        cycle.begin(point)
        motion = skate(cycle.sim, 2, observe=False)
        if len(motion.orders) != 1:
            raise ValueError("no complete step")
        order = motion.orders[0]
        values = {name: TERMS[name].measure(motion) for name in self._weights}
        sequence = order.sequence()
        values |= {f"state {state}": 1e3 * order.dwell[state] for state in sorted({*sequence})}
        found = np.linalg.eigvals(linear.P).astype(complex)
        own = int(np.abs(found - 1.0).argmin())
        if abs(found[own] - 1.0) > _OWN:
            raise ValueError(f"the orbit's own multiplier is {found[own]:.4f}")
        return Gait(point, values, sequence, np.delete(found, own))

    def _tangent(self) -> tuple[Array, Array]:
        """Return the derivatives of state (s, m) and period (m,) by the variables."""
        scene = self.at(self.x)
        linear = Cycle(scene).linearize(self.gait.point, self._fields)
        change = linear.solve(-linear.by_parameters)
        values = scene.parameters()
        units = np.zeros((len(self._fields), len(self.variables)))
        for j, each in enumerate(self.variables):
            for name in each.fields:
                size = values[name][0] if each.factor else 1.0
                units[self._fields.index(name), j] = size * each.unit
        return linear.basis @ change[:-1] @ units, change[-1] @ units

    def _gait(self, x: Array, tangent: tuple[Array, Array]) -> Gait:
        """Close the cycle at ``x`` from the tangent of the present one.

        Raises
        ------
        ValueError
            If it does not close, or has another sequence of states.
        """
        cycle, dx = Cycle(self.at(x)), x - self.x
        by_state, by_period = tangent
        start = moved(self.gait.point, by_state @ dx, float(by_period @ dx))
        try:
            gait = self._measure(cycle, *cycle.close(start)[:2])
        except ValueError as error:
            here = Cycle(self.at(self.x)).events(self.gait.point)
            raise ValueError(f"{error}; {_difference(here, cycle.events(start))}") from None
        if gait.sequence != self.gait.sequence:
            raise ValueError(f"contact states {'-'.join(map(str, gait.sequence))}")
        return gait

    def _slopes(self, tangent: tuple[Array, Array]) -> tuple[dict[str, Array], Array]:
        """Return derivatives of the values (m,), and of the multipliers' moduli (k, m).

        They are differences of closed cycles. NaN where the cycle opens on both sides.
        """
        here, m = self.gait, len(self.x)
        slopes = {name: np.full(m, np.nan) for name in here.values}
        moduli = np.full((len(here.multipliers), m), np.nan)
        for j in range(m):
            sides = []
            for side in (-_STEP, _STEP):
                try:
                    sides.append((side, self._gait(self.x + side * np.eye(m)[j], tangent)))
                except ValueError:
                    continue
            if not sides:
                continue
            if len(sides) == 1:
                sides.append((0.0, here))
            (a, low), (b, high) = sides
            for name, slope in slopes.items():
                slope[j] = (high.values[name] - low.values[name]) / (b - a)
            for i, each in enumerate(here.multipliers):
                ends = [g.multipliers[np.abs(g.multipliers - each).argmin()] for g in (low, high)]
                moduli[i, j] = (abs(ends[1]) - abs(ends[0])) / (b - a)
        return slopes, moduli

    def _program(self, slopes: dict[str, Array], moduli: Array, box: float) -> tuple[Array, float]:
        """Return the best change of x in a box (m,), and the merit that it predicts."""
        m = len(self.x)
        costs: list[float] = []
        rows: list[tuple[Array, float, int | None]] = []
        values = self.gait.values
        for name, bounds in self._limits.items():
            unit, column = TERMS[name].unit, m + len(costs)
            costs.append(self._weights[name])
            if np.isfinite(bounds.at_least):
                rows.append((-slopes[name] / unit, (values[name] - bounds.at_least) / unit, column))
            if np.isfinite(bounds.at_most):
                rows.append((slopes[name] / unit, (bounds.at_most - values[name]) / unit, column))
        if values[_TOE] < 0.0:
            rows.append((slopes[_TOE], max(-self._margin - values[_TOE], 0.0), None))
        for name in values:
            if name.startswith("state"):
                rows.append((-slopes[name], max(values[name] - _DWELL, 0.0), None))
        sizes = np.abs(self.gait.multipliers)
        if self._cost_of_excess:
            for slope, size in zip(moduli, sizes, strict=True):
                if size > _SMALL:
                    rows.append((slope, self._bound - size, m + len(costs)))
                    costs.append(self._cost_of_excess)
        matrix = np.zeros((len(rows), m + len(costs)))
        for row, (slope, _, slack) in zip(matrix, rows, strict=True):
            row[:m] = np.nan_to_num(slope)
            if slack is not None:
                row[slack] = -1.0
        fixed = np.isnan(next(iter(slopes.values())))
        ranges = [(0.0, 0.0) if each else (-box, box) for each in fixed]
        found = linprog(
            np.concatenate([np.zeros(m), costs]),
            A_ub=matrix,
            b_ub=[bound for _, bound, _ in rows],
            bounds=ranges + [(0.0, None)] * len(costs),
        )
        if found.status != 0:
            raise RuntimeError(f"linear program: {found.message}")
        return np.asarray(found.x[:m]), float(found.fun)

    def _require(self, x: Array, gait: Gait, predicted: float) -> None:
        """Raise ValueError for too small a decrease of the merit, or too few steps of a start."""
        merit = self.merit(self.gait)
        if self.merit(gait) > merit + _DECREASE * (predicted - merit):
            raise ValueError(f"no better, {self.merit(gait):.4f}")
        scene = changed(self._given, self.variables, x)
        for seed in range(self._starts):
            sim = Simulator(scene)
            sim.perturb(SIGMA, seed)
            steps = record(sim, _STEPS, every=ONLY_FIRST).steps.size
            if steps < _STEPS:
                raise ValueError(f"{steps} steps from the start perturbed with seed {seed}")

    def result(self) -> Scene:
        """Return the given scene with the variables of the gait; it keeps its start."""
        return changed(self._given, self.variables, self.x)


def _difference(before: list[str], after: list[str]) -> str:
    """Return the first difference between two sequences of events."""
    for old, new in zip_longest(before, after, fillvalue="the end"):
        if old != new:
            return f"{new}, before: {old}"
    return "the same events"
