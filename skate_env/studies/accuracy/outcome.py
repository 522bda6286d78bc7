"""What a run came to, and how far it is from another."""

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Outcome:
    """What one run came to."""

    time: float
    """Reached [s]."""
    termination: str | None
    q: Array
    """At the end, counted from the foot that supports then."""
    v: Array
    states: tuple[int, ...]
    """Numbers of the states passed, first one included; empty where there are none (MuJoCo)."""
    event_times: tuple[float, ...]
    slide: float
    """Way of the supporting foot's pivot: ``q[0]`` at the end without that of the start [m].

    Where the legs swap it leads from the first supporting foot to the last.
    """
    energy_residual: float | None
    """What the energy account does not explain [J]."""
    drift: float | None
    """How far the free foot got off its contact [m] (rad for its angle)."""
    penetration: float | None
    """Deepest point of a sole below ice that only pushes [m]."""
    pull: float | None
    """Largest force with which ice that only pushes pulls [N]."""
    cone_excess: float | None
    """Largest force along the ice beyond what friction allows [N]."""
    stats: dict[str, float]


@dataclass(frozen=True)
class Errors:
    """How wrong a run is; None where that cannot be said."""

    position: float | None = None
    """Largest error of a coordinate at the end [rad], [m]."""
    event_time: float | None = None
    """Largest error of an event's instant [s]."""
    slide: float | None = None
    """[m]"""
    energy: float | None = None
    """[J]"""
    drift: float | None = None
    """[m]"""
    penetration: float | None = None
    """[m]"""
    pull: float | None = None
    """[N]"""
    cone_excess: float | None = None
    """[N]"""


LOST = 1.0
"""A coordinate that is further off than this has lost the motion [rad], [m]."""
QUANTITIES = tuple(item.name for item in fields(Errors))
# Events closer than this happen at one instant [s].
_INSTANT = 1e-9
COMPARED = ("position", "event_time", "slide")
"""The errors that need a reference; the others are wrong by themselves."""


def other_states(outcome: Outcome, reference: Outcome) -> str | None:
    """Say from where on a run passes other states than the reference, or None."""
    states, true = _passed(outcome), _passed(reference)
    if not states or states == true:
        return None
    return f"other states from the {_first_difference(states, true) + 1}. on"


def failure(outcome: Outcome, reference: Outcome, locates: bool = True) -> str | None:
    """Say why a run is no approximation of the reference at all, or None.

    A method that ``locates`` events has to pass the same states.
    """
    if outcome.termination != reference.termination:
        return f"{outcome.termination or 'no end'} at {outcome.time:.4g} s"
    if not (np.isfinite(outcome.q).all() and np.isfinite(outcome.v).all()):
        return "not finite"
    if locates and (said := other_states(outcome, reference)):
        return said
    off = float(np.abs(outcome.q - reference.q).max())
    if off > LOST:
        return f"{off:.3g} rad or m off"
    return None


def errors(outcome: Outcome, reference: Outcome) -> Errors:
    """Measure a run that did not fail against the reference."""
    times = outcome.event_times
    same = outcome.states == reference.states and len(times) == len(reference.event_times) > 0
    return Errors(
        position=float(np.abs(outcome.q - reference.q).max()),
        event_time=float(np.abs(np.subtract(times, reference.event_times)).max()) if same else None,
        slide=abs(outcome.slide - reference.slide),
        energy=None if outcome.energy_residual is None else abs(outcome.energy_residual),
        drift=outcome.drift,
        penetration=outcome.penetration,
        pull=outcome.pull,
        cone_excess=outcome.cone_excess,
    )


def root_mean_square(of: list[Errors]) -> Errors:
    """Average over the starts that have a figure."""
    return Errors(**{name: _rms([getattr(one, name) for one in of]) for name in QUANTITIES})


def largest(of: list[Errors]) -> Errors:
    """Take the largest of the errors that need a reference; None where there is none."""
    found = {name: [x for one in of if (x := getattr(one, name)) is not None] for name in COMPARED}
    return Errors(**{name: max(values) for name, values in found.items() if values})


def _rms(values: list[float | None]) -> float | None:
    known = [x for x in values if x is not None]
    return float(np.sqrt(np.mean(np.square(known)))) if known else None


def _passed(outcome: Outcome) -> tuple[int, ...]:
    """Leave out events at the instant of another that do not change the state's number.

    Those that fall on one instant may come in either order, and one of them may do nothing.
    """
    states, times = outcome.states, outcome.event_times
    crowded = [
        any(abs(time - other) < _INSTANT for other in (*times[:i], *times[i + 1 :]))
        for i, time in enumerate(times)
    ]
    after = zip(states, states[1:], crowded, strict=False)
    return states[:1] + tuple(new for old, new, same in after if not (same and new == old))


def _first_difference(a: tuple[int, ...], b: tuple[int, ...]) -> int:
    pairs = enumerate(zip(a, b, strict=False))
    return next((i for i, (x, y) in pairs if x != y), min(len(a), len(b)))
