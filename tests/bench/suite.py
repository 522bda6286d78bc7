"""All measurements of a benchmark run."""

import os
import time
from dataclasses import asdict, dataclass, field
from typing import Any

from skate_env.studies.report import stamp

from .derivatives import derivatives
from .environments import environments
from .equal_steps import equal_steps
from .evaluations import evaluations
from .located_steps import located_steps
from .resets import resets
from .scaling import more_environments, more_freedom, more_threads
from .sizes import Sizes
from .steps import steps
from .table import Group

EVALUATIONS, STEPS = "evaluations", "steps"
ENVIRONMENTS, EQUAL_STEPS = "environments", "equal_steps"
LOCATED_STEPS = "located_steps"
RESETS, DERIVATIVES = "resets", "derivatives"
MORE_ENVIRONMENTS, MORE_THREADS, MORE_FREEDOM = "more_environments", "more_threads", "more_freedom"

# Distributions, and environment variables with the number of threads of linear algebra, that
# determine the results.
_PACKAGES = ("skate_env", "numpy", "gymnasium", "mujoco", "pin", "drake")
_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


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
    threads = {name: os.environ[name] for name in _THREADS if name in os.environ}
    bench = Bench(stamp(_PACKAGES) | threads)
    groups = bench.groups
    groups[EVALUATIONS] = evaluations(sizes)
    groups[STEPS] = steps(sizes)
    groups[ENVIRONMENTS] = environments(sizes)
    if sizes.by_error:
        groups[EQUAL_STEPS] = equal_steps(sizes)
    groups[LOCATED_STEPS] = located_steps(sizes)
    groups[MORE_ENVIRONMENTS] = more_environments(sizes)
    groups[MORE_THREADS] = more_threads(sizes)
    groups[MORE_FREEDOM] = more_freedom(sizes)
    groups[RESETS] = resets(sizes)
    groups[DERIVATIVES] = derivatives(sizes)
    bench.seconds = time.perf_counter() - begun
    return bench
