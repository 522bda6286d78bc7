"""Hyperparameters as a dataclass: the ranges of its numbers, and overrides by name."""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any, TypeVar, get_args, get_origin, get_type_hints

from ..common import between, known, shown, whole

T = TypeVar("T")


@dataclass(frozen=True)
class Range:
    """Range of a field, both ends included: ``rate: Annotated[float, Range(0.0, 1.0)]``."""

    low: float
    high: float
    most: int = 16
    """Largest number of elements of a ``tuple[T, ...]``."""


def check(numbers: object) -> None:
    """Check a dataclass's fields: with a `Range` an int, float or tuple of one of them.

    Raises
    ------
    TypeError, ValueError
        If a field has another type, or a number is out of range.
    """
    for name, hint in get_type_hints(type(numbers), include_extras=True).items():
        given = getattr(numbers, name)
        declared, within = get_args(hint)
        elements = get_args(declared) if get_origin(declared) is tuple else ()
        if elements:
            least, most = (1, within.most) if ... in elements else (len(elements),) * 2
            if not isinstance(given, tuple) or not least <= len(given) <= most:
                raise ValueError(f"{name} = {shown(given)}: must be {least} to {most} numbers")
        for number in given if elements else [given]:
            if int in (declared, *elements):
                whole(name, number)
            between(name, number, within.low, within.high)


def override(numbers: T, overrides: Iterable[tuple[str, Any]]) -> T:
    """Copy a dataclass with some fields replaced.

    Parameters
    ----------
    numbers
        A dataclass that calls `check` when it is made.
    overrides
        Names and values; a list, or a single number, stands for a tuple.

    Raises
    ------
    ValueError
        If a name is unknown, or a value is invalid.
    """
    changes: dict[str, Any] = {}
    for name, given in overrides:
        known("hyperparameter", [name], vars(numbers))
        if isinstance(getattr(numbers, name), tuple):
            given = tuple(given) if isinstance(given, list) else (given,)
        changes[name] = given
    try:
        # mypy does not know that T is a dataclass.
        return replace(numbers, **changes)  # type: ignore[type-var]
    except TypeError as error:
        raise ValueError(str(error)) from None
