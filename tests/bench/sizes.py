"""Sizes of a benchmark run."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Sizes:
    """Numbers of rounds (at least two), states and environments."""

    rounds: int
    """Rounds of short blocks."""
    long_rounds: int
    """Rounds of blocks that take milliseconds."""
    states: int
    """States of each kind."""
    environments: int
    """Environments of a batch, except in the scaling tables."""
    most_environments: int
    """Largest batch of the scaling tables."""
    landings: int
    """Random landings, and flights."""
    by_error: bool
    """Whether environment steps are compared at equal errors."""


def full() -> Sizes:
    """Return the sizes of a full run of some minutes."""
    return Sizes(1500, 60, 6, 1024, 4096, 20, by_error=True)


def quick() -> Sizes:
    """Return the sizes of a run below a minute, without environments at equal errors."""
    return Sizes(10, 2, 2, 64, 64, 2, by_error=False)
