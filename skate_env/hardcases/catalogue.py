"""All hard cases, by kind."""

from . import events, forces, friction
from .case import Case

_CHAPTERS = (forces, friction, events)

CASES: dict[str, Case] = {
    case.name: case for chapter in _CHAPTERS for case in chapter.CHAPTER.cases
}
