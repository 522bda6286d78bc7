"""The methods of the engine, and how finely each is set."""

from dataclasses import dataclass
from typing import Any

from .cases import STARTS, Case


@dataclass(frozen=True)
class Setting:
    """A method, and how fine it is."""

    method: str
    label: str
    """For people, and unique within a method."""
    value: float | None
    """The tolerance, or the step [s]; None for an accuracy that has a name."""
    accuracy: Any
    """What a scene's field ``accuracy`` is to hold, or another tool's own setting."""
    fixed_step: bool = False
    """`value` is the length of its steps."""

    @property
    def locates(self) -> bool:
        """Say whether the method stops at every event, and so passes all states of the motion."""
        return not {self.method, self.label} & _STEPPING


# Time-stepping: what happens within a step happens at once, and short states are passed over.
_STEPPING = {"moreau", "fast"}
TOLERANCE, STEP = "tolerance", "step"
NAMED = "named"
"""The method of the accuracies that have a name."""

# Their value is a relative tolerance, or a step [s].
_METHODS: dict[str, tuple[str, tuple[float, ...]]] = {
    "dopri5": (TOLERANCE, tuple(10.0**-k for k in range(2, 12))),
    "rk4": (STEP, tuple(4e-3 / 2**k for k in range(7))),
    "rosenbrock": (TOLERANCE, tuple(10.0**-k for k in range(2, 8))),
    "moreau": (STEP, tuple(4e-2 / 2**k for k in range(9))),
}
_NAMES = ("fast", "balanced", "reference")

TIGHTEST = 1e-13
"""Tolerance of the reference."""
NEXT_TIGHTEST = 1e-12
"""How far this one is from the reference says how far the reference is from convergence."""


def dopri5(tolerance: float) -> Setting:
    """Set the error-controlled explicit method."""
    return _setting("dopri5", tolerance)


@dataclass(frozen=True)
class Extent:
    """How much of the study is made."""

    starts: int
    """Of motions that are not smooth."""
    settings: tuple[Setting, ...]
    """Of the engine."""
    thin: bool
    """Other tools leave out every second setting."""
    solvers: tuple[tuple[str, int], ...]
    """SciPy's solvers, and from how many starts each carries a motion at most."""
    rounds: int
    """Of the timing."""
    instructions: bool
    """They are counted."""
    steps: int
    """Of the long walk; 0 for none."""

    def starts_of(self, case: Case) -> int:
        """Count the starts of a case, the scene's own included."""
        return 1 if case.smooth else self.starts


def full() -> Extent:
    """Leave nothing out."""
    solvers = (("DOP853", STARTS), ("Radau", 1))
    return Extent(STARTS, tuple(settings()), False, solvers, 200, instructions=True, steps=100)


def quick() -> Extent:
    """Get a first impression within two minutes."""
    solvers = (("DOP853", 1),)
    return Extent(3, tuple(settings(2)), True, solvers, 20, instructions=False, steps=20)


def settings(every: int = 1) -> list[Setting]:
    """All settings, coarse to fine within a method, or only every so many of them."""
    named = [Setting(NAMED, name, None, name) for name in _NAMES]
    fine = [_setting(method, x) for method, (_, xs) in _METHODS.items() for x in xs[::every]]
    return named + fine


def _setting(method: str, value: float) -> Setting:
    kind = _METHODS[method][0]
    label = milliseconds(value) if kind == STEP else f"{value:.0e}"
    return Setting(method, label, value, {"method": method, kind: value}, kind == STEP)


def milliseconds(step: float) -> str:
    """Write a step [s]."""
    return f"{1e3 * step:.4g} ms"
