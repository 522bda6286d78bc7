"""All hard cases, by kind."""

from . import forces
from .case import Case

CASES: dict[str, Case] = {
    case.name: case for chapter in (forces.CHAPTER,) for case in chapter.cases
}
