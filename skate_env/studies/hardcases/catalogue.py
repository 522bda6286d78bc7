"""All hard cases, by kind."""

from . import (
    controllers,
    derivatives,
    events,
    forces,
    friction,
    invariances,
    laws,
    long_runs,
    numbers,
    stiffness,
)
from .case import Case

_GROUPS = (
    *(forces, friction, events, controllers, stiffness, numbers, long_runs, invariances, laws),
    derivatives,
)

CASES: dict[str, Case] = {case.name: case for group in _GROUPS for case in group.GROUP.cases}
