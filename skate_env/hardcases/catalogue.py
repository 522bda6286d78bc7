"""All hard cases, by kind."""

from . import continuing, controllers, events, forces, friction, long_runs, numbers, stiffness
from .case import Case

_CHAPTERS = (forces, friction, events, controllers, stiffness, numbers, long_runs, continuing)

CASES: dict[str, Case] = {
    case.name: case for chapter in _CHAPTERS for case in chapter.CHAPTER.cases
}
