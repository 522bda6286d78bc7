"""Methods of the engine and their settings."""

from dataclasses import dataclass
from typing import Any

from ..motions.cases import STARTS, Case


@dataclass(frozen=True)
class Setting:
    """A method at a tolerance or step."""

    method: str
    label: str
    """Description, unique within a method."""
    value: float | None
    """Tolerance, or step [s]; None for a named accuracy."""
    accuracy: Any
    """Value of a scene's field ``accuracy``, or a setting of another tool."""
    fixed_step: bool = False
    """Whether `value` is the length of fixed steps."""

    @property
    def locates(self) -> bool:
        """Whether the method locates events and therefore has all contact states."""
        return not {self.method, self.label} & _STEPPING


# Time-stepping: all events of a step are simultaneous, and short contact states are skipped.
_STEPPING = {"moreau", "fast"}
TOLERANCE, STEP = "tolerance", "step"
NAMED = "named"
"""The method of the named accuracies."""

# Kind of setting, and values: relative tolerances, or steps [s].
_METHODS: dict[str, tuple[str, tuple[float, ...]]] = {
    "dop853": (TOLERANCE, tuple(10.0**-k for k in range(2, 12))),
    "dopri5": (TOLERANCE, tuple(10.0**-k for k in range(2, 12))),
    "rk4": (STEP, tuple(4e-3 / 2**k for k in range(7))),
    "rosenbrock": (TOLERANCE, tuple(10.0**-k for k in range(2, 8))),
    "moreau": (STEP, tuple(4e-2 / 2**k for k in range(9))),
}
_NAMES = ("fast", "balanced", "reference")

TIGHTEST = 1e-13
"""Tolerance of the reference."""
NEXT_TIGHTEST = 1e-12
"""Tolerance whose difference from the reference estimates the reference's error."""


def dopri5(tolerance: float) -> Setting:
    """Return the method of the references, not that of the named accuracies, at a tolerance."""
    return _setting("dopri5", tolerance)


@dataclass(frozen=True)
class StudySize:
    """Number of starts, settings, rounds and steps of a study."""

    starts: int
    """Starts of motions that are not smooth."""
    settings: tuple[Setting, ...]
    """Settings of the engine."""
    thin: bool
    """Whether other tools omit every second setting."""
    solvers: tuple[tuple[str, int], ...]
    """SciPy's solvers, each with its largest number of starts."""
    rounds: int
    """Rounds of the timing."""
    steps: int
    """Gait steps of the long simulation; 0 for none."""

    def starts_of(self, case: Case) -> int:
        """Return the number of starts of a case, the scene's own included."""
        return 1 if case.smooth else self.starts


def full() -> StudySize:
    """Return the size of the full study."""
    solvers = (("DOP853", STARTS), ("Radau", 1))
    return StudySize(STARTS, tuple(settings()), False, solvers, 200, steps=100)


def quick() -> StudySize:
    """Return the size of a study of at most two minutes."""
    solvers = (("DOP853", 1),)
    return StudySize(3, tuple(settings(2)), True, solvers, 20, steps=20)


def settings(every: int = 1) -> list[Setting]:
    """Return every `every`-th setting of each method, coarse to fine, and all named accuracies."""
    named = [Setting(NAMED, name, None, name) for name in _NAMES]
    fine = [_setting(method, x) for method, (_, xs) in _METHODS.items() for x in xs[::every]]
    return named + fine


def _setting(method: str, value: float) -> Setting:
    kind = _METHODS[method][0]
    label = milliseconds(value) if kind == STEP else f"{value:.0e}"
    return Setting(method, label, value, {"method": method, kind: value}, kind == STEP)


def milliseconds(step: float) -> str:
    """Format a step [s]."""
    return f"{1e3 * step:.4g} ms"
