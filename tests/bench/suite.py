"""All measurements of a benchmark run."""

import time
from dataclasses import asdict, dataclass, field
from typing import Any

from .derivatives import derivatives
from .environments import environments
from .equal_steps import equal_steps
from .evaluations import evaluations
from .peers import stamp
from .resets import resets
from .scaling import more_environments, more_freedom, more_threads
from .sizes import Sizes
from .steps import steps
from .table import Group

EVALUATIONS, STEPS = "evaluations", "steps"
ENVIRONMENTS, EQUAL_STEPS = "environments", "equal_steps"
RESETS, DERIVATIVES = "resets", "derivatives"
MORE_ENVIRONMENTS, MORE_THREADS, MORE_FREEDOM = "more_environments", "more_threads", "more_freedom"


@dataclass
class Bench:
    """Results of a run."""

    stamp: dict[str, str]
    """Machine and versions."""
    seconds: float = 0.0
    """Duration of the run [s]."""
    groups: dict[str, Group] = field(default_factory=dict)

    def summary(self) -> dict[str, Any]:
        """Return all results as JSON values; None where nothing was measured."""
        return asdict(self)


def run(sizes: Sizes) -> Bench:
    """Run all measurements, with progress bars on stderr."""
    begun = time.perf_counter()
    bench = Bench(stamp())
    groups = bench.groups
    groups[EVALUATIONS] = evaluations(sizes)
    groups[STEPS] = steps(sizes)
    groups[ENVIRONMENTS] = environments(sizes)
    if sizes.by_error:
        groups[EQUAL_STEPS] = equal_steps(sizes)
    groups[MORE_ENVIRONMENTS] = more_environments(sizes)
    groups[MORE_THREADS] = more_threads(sizes)
    groups[MORE_FREEDOM] = more_freedom(sizes)
    groups[RESETS] = resets(sizes)
    groups[DERIVATIVES] = derivatives(sizes)
    bench.seconds = time.perf_counter() - begun
    return bench
