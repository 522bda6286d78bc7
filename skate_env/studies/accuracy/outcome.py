"""Outcome of a run, and its errors relative to a reference."""

from dataclasses import dataclass, field, fields

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Outcome:
    """Final state and statistics of a run."""

    time: float
    """Time at the end [s]."""
    termination: str | None
    q: Array
    """Final coordinates, relative to the final supporting foot."""
    v: Array
    states: tuple[int, ...]
    """Numbers of the contact states in order, first one included; empty for MuJoCo."""
    event_times: tuple[float, ...]
    slide: float
    """Displacement ``q[0]`` of the supporting foot's pivot [m].

    After a leg swap it is measured from the first to the last supporting foot.
    """
    energy_residual: float | None = None
    """Energy change that the energy balance does not explain [J]."""
    drift: float | None = None
    """Largest violation of the free foot's constraints [m] ([rad] for its angle)."""
    penetration: float | None = None
    """Largest depth of a sole below the ice with push-only contact [m]."""
    pull: float | None = None
    """Largest pulling force of push-only contact [N]."""
    cone_excess: float | None = None
    """Largest tangential force outside the friction cone [N]."""
    stats: dict[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Errors:
    """Errors of a run; None where an error is not defined."""

    position: float | None = None
    """Largest error of a final coordinate [rad or m]."""
    event_time: float | None = None
    """Largest error of an event time [s]."""
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
"""Largest error of a coordinate that counts as the same motion [rad or m]."""
QUANTITIES = tuple(item.name for item in fields(Errors))
# Events closer than this are simultaneous [s].
_INSTANT = 1e-9
COMPARED = ("position", "event_time", "slide")
"""Errors relative to a reference; the others are violations of laws."""


def other_states(outcome: Outcome, reference: Outcome) -> str | None:
    """Describe where the contact states differ from the reference; None if they are equal."""
    states, true = _distinct_states(outcome), _distinct_states(reference)
    if not states or states == true:
        return None
    return f"other contact states from number {_first_difference(states, true) + 1} on"


def failure(outcome: Outcome, reference: Outcome, locates: bool = True) -> str | None:
    """Describe why a run does not approximate the reference; None if it does.

    A method that ``locates`` events must have the same contact states.
    """
    if outcome.termination != reference.termination:
        return f"{outcome.termination or 'no end'} at {outcome.time:.4g} s"
    if not (np.isfinite(outcome.q).all() and np.isfinite(outcome.v).all()):
        return "not finite"
    if locates and (difference := other_states(outcome, reference)):
        return difference
    off = float(np.abs(outcome.q - reference.q).max())
    if off > LOST:
        return f"error of {off:.3g} rad or m"
    return None


def errors(outcome: Outcome, reference: Outcome) -> Errors:
    """Compute the errors of a run that did not fail."""
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
    """Average over the starts for which an error is defined."""
    return Errors(**{name: _rms([getattr(one, name) for one in of]) for name in QUANTITIES})


def largest(of: list[Errors]) -> Errors:
    """Return the largest errors relative to a reference; None where none is defined."""
    found = {name: [x for one in of if (x := getattr(one, name)) is not None] for name in COMPARED}
    return Errors(**{name: max(values) for name, values in found.items() if values})


def _rms(values: list[float | None]) -> float | None:
    known = [x for x in values if x is not None]
    return float(np.sqrt(np.mean(np.square(known)))) if known else None


def _distinct_states(outcome: Outcome) -> tuple[int, ...]:
    """Return the contact states without simultaneous events that do not change the state.

    The order of simultaneous events is arbitrary, and one of them may not change the state.
    """
    states, times = outcome.states, outcome.event_times
    simultaneous = [
        any(abs(time - other) < _INSTANT for other in (*times[:i], *times[i + 1 :]))
        for i, time in enumerate(times)
    ]
    after = zip(states, states[1:], simultaneous, strict=False)
    return states[:1] + tuple(new for old, new, together in after if not (together and new == old))


def _first_difference(a: tuple[int, ...], b: tuple[int, ...]) -> int:
    pairs = enumerate(zip(a, b, strict=False))
    return next((i for i, (x, y) in pairs if x != y), min(len(a), len(b)))
