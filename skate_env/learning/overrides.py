"""Overrides of a dataclass's numbers by dotted name: ``rate``, ``weights.flight``."""

import json
from collections.abc import Iterable
from dataclasses import is_dataclass, replace
from typing import Any, TypeVar

from ..validation import known

T = TypeVar("T")


def override(numbers: T, overrides: Iterable[tuple[str, Any]]) -> T:
    """Copy a dataclass, whose fields may be dataclasses, with some numbers replaced.

    Parameters
    ----------
    numbers
        Its fields are numbers, booleans, tuples of one type, or dataclasses of these.
    overrides
        Dotted names and values; a single number stands for a tuple of length one.

    Raises
    ------
    ValueError
        If a name is unknown, or a value has another type than the field.
    """
    for name, given in overrides:
        own = _flat(numbers)
        known("hyperparameter", [name], own)
        several = isinstance(own[name], tuple)
        values = given if several and isinstance(given, list) else [given]
        kind = type(own[name][0] if several else own[name])
        kinds = {float, int} if kind is float else {kind}
        if not values or not kinds.issuperset(map(type, values)):
            shown, example = json.dumps(given), json.dumps(own[name])
            raise ValueError(f"{name} = {shown}: must be of the same type as {example}")
        numbers = _with(numbers, name, tuple(values) if several else given)
    return numbers


def _flat(numbers: Any) -> dict[str, Any]:
    fields: dict[str, Any] = {}
    for name, value in vars(numbers).items():
        if is_dataclass(value):
            fields |= {f"{name}.{inner}": each for inner, each in _flat(value).items()}
        else:
            fields[name] = value
    return fields


def _with(numbers: Any, name: str, value: Any) -> Any:
    outer, dot, inner = name.partition(".")
    if dot:
        value = _with(getattr(numbers, outer), inner, value)
    return replace(numbers, **{outer: value})
