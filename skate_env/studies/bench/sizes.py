"""How much is measured."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Extent:
    """Rounds, two at least, and sizes."""

    rounds: int
    """Of short blocks."""
    long_rounds: int
    """Of blocks of milliseconds."""
    states: int
    """Of each kind that a block goes through."""
    environments: int
    """Of a batch where their number does not matter."""
    most_environments: int
    updates: int
    """Of every learner."""
    rollout: int
    """Environment steps of an update."""
    equal_error: bool
    """Methods are compared at equal errors."""


def full() -> Extent:
    """Measure everything, in some minutes."""
    return Extent(1500, 60, 6, 1024, 4096, 12, 8192, equal_error=True)


def quick() -> Extent:
    """Try everything but the comparison at equal errors, within a minute."""
    return Extent(10, 2, 2, 64, 64, 2, 512, equal_error=False)
