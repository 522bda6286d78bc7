"""All hard cases, by kind."""

from . import events, forces, friction, stiffness
from .case import Case

_CHAPTERS = (forces, friction, events, stiffness)

CASES: dict[str, Case] = {
    case.name: case for chapter in _CHAPTERS for case in chapter.CHAPTER.cases
}
