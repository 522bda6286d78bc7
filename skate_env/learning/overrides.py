"""Overrides of a dataclass's numbers by name."""

import json
from collections.abc import Iterable
from dataclasses import replace
from typing import Any, TypeVar

from ..validation import known

T = TypeVar("T")


def override(numbers: T, overrides: Iterable[tuple[str, Any]]) -> T:
    """Copy a dataclass with some numbers replaced.

    Parameters
    ----------
    numbers
        Its fields are numbers, booleans, or tuples of one type.
    overrides
        Names and values; a single number stands for a tuple of length one.

    Raises
    ------
    ValueError
        If a name is unknown, or a value has another type than the field.
    """
    changes: dict[str, Any] = {}
    for name, given in overrides:
        own = vars(numbers)
        known("hyperparameter", [name], own)
        several = isinstance(own[name], tuple)
        values = given if several and isinstance(given, list) else [given]
        kind = type(own[name][0] if several else own[name])
        kinds = {float, int} if kind is float else {kind}
        if not values or not kinds.issuperset(map(type, values)):
            shown, example = json.dumps(given), json.dumps(own[name])
            raise ValueError(f"{name} = {shown}: must be of the same type as {example}")
        changes[name] = tuple(values) if several else given
    # mypy does not know that T is a dataclass.
    return replace(numbers, **changes)  # type: ignore[type-var]
