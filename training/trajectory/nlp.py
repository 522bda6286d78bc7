"""A nonlinear program that is built piece by piece and solved by IPOPT."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike, NDArray

from .robot import numbers

Array = NDArray[np.float64]


@dataclass
class Nlp:
    """Variables, constraints and cost.

    Attributes
    ----------
    cost
        What is minimised.
    """

    cost: Any = 0.0
    _variables: list[Any] = field(default_factory=list)
    _guess: list[Array] = field(default_factory=list)
    _bounds: list[tuple[Array, Array]] = field(default_factory=list)
    _constraints: list[Any] = field(default_factory=list)
    _limits: list[tuple[Array, Array]] = field(default_factory=list)

    def variable(
        self, guess: ArrayLike, lower: ArrayLike, upper: ArrayLike, scale: ArrayLike = 1.0
    ) -> Any:
        """Add a vector; return it in its own units. `scale` is its usual size."""
        start = np.atleast_1d(np.asarray(guess, float))
        size = np.broadcast_to(np.asarray(scale, float), start.shape)
        symbol = ca.MX.sym(f"x{len(self._variables)}", len(start))
        self._variables.append(symbol)
        self._guess.append(start / size)
        low, high = (
            np.broadcast_to(np.asarray(bound, float), start.shape) / size
            for bound in (lower, upper)
        )
        self._bounds.append((low, high))
        return symbol * ca.DM(size)

    def constrain(self, expression: Any, lower: ArrayLike = 0.0, upper: ArrayLike = 0.0) -> None:
        """Require lower <= expression <= upper, element by element."""
        column = ca.vec(expression)
        shape = (column.shape[0],)
        self._constraints.append(column)
        low, high = (np.broadcast_to(np.asarray(bound, float), shape) for bound in (lower, upper))
        self._limits.append((low, high))

    def solve(
        self, iterations: int, barrier: tuple[float, float], show: bool
    ) -> tuple[Any, str, float]:
        """Solve from the guesses; ``barrier`` has its first and last parameter.

        Returns
        -------
        value, status, violation
            A function that evaluates expressions at the solution, IPOPT's status and the largest
            violation of a constraint.
        """
        x, g = ca.vertcat(*self._variables), ca.vertcat(*self._constraints)
        options = {
            "ipopt.max_iter": iterations,
            "ipopt.mu_init": barrier[0],
            "ipopt.mu_target": barrier[1],
            "ipopt.tol": 1e-6,
            "ipopt.constr_viol_tol": 1e-7,
            "ipopt.acceptable_tol": 1e-4,
            "ipopt.print_level": 5 if show else 0,
            "print_time": False,
        }
        solver = ca.nlpsol("step", "ipopt", {"x": x, "f": self.cost, "g": g}, options)
        result = solver(
            x0=np.concatenate(self._guess),
            lbx=_joined(self._bounds, 0),
            ubx=_joined(self._bounds, 1),
            lbg=_joined(self._limits, 0),
            ubg=_joined(self._limits, 1),
        )
        found = result["x"]

        def value(expression: Any) -> Array:
            return numbers(ca.Function("value", [x], [expression])(found))

        stats = solver.stats()
        return value, str(stats["return_status"]), float(stats["iterations"]["inf_pr"][-1])


def _joined(pairs: Sequence[tuple[Array, Array]], which: int) -> Array:
    return np.concatenate([pair[which] for pair in pairs])
