"""Everything that is measured, in one run."""

import time
from dataclasses import asdict, dataclass, field
from typing import Any

from .environments import environments
from .equal_steps import equal_steps
from .evaluations import evaluations
from .learner import learner
from .peers import stamp
from .resets import resets
from .scaling import more_environments, more_freedom, more_threads
from .sizes import Extent
from .steps import equal_error, steps
from .table import Group

EVALUATIONS, STEPS, EQUAL_ERROR = "evaluations", "steps", "equal_error"
ENVIRONMENTS, EQUAL_STEPS = "environments", "equal_steps"
RESETS, LEARNER = "resets", "learner"
MORE_ENVIRONMENTS, MORE_THREADS, MORE_FREEDOM = "more_environments", "more_threads", "more_freedom"


@dataclass
class Bench:
    """What a run came to."""

    stamp: dict[str, str]
    """Machine and versions."""
    seconds: float = 0.0
    """That all of it took."""
    groups: dict[str, Group] = field(default_factory=dict)

    def summary(self) -> dict[str, Any]:
        """Everything, for programs; None where there is no figure."""
        return asdict(self)


def run(extent: Extent) -> Bench:
    """Measure everything, with progress bars on stderr."""
    begun = time.perf_counter()
    bench = Bench(stamp())
    groups = bench.groups
    groups[EVALUATIONS] = evaluations(extent)
    groups[STEPS] = steps(extent)
    if extent.equal_error:
        groups[EQUAL_ERROR] = equal_error()
    groups[ENVIRONMENTS] = environments(extent)
    if extent.equal_error:
        groups[EQUAL_STEPS] = equal_steps(extent)
    groups[MORE_ENVIRONMENTS] = more_environments(extent)
    groups[MORE_THREADS] = more_threads(extent)
    groups[MORE_FREEDOM] = more_freedom(extent)
    groups[RESETS] = resets(extent)
    groups[LEARNER] = learner(extent)
    bench.seconds = time.perf_counter() - begun
    return bench
