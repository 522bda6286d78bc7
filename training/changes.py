"""Numbers of a dataclass, changed by people: ``rate=1e-3``, ``weights.flight=[1, 4]``."""

import json
from collections.abc import Iterable
from dataclasses import is_dataclass, replace
from typing import Any, TypeVar

from skate_env.arguments import known
from skate_env.options import name_and_value

T = TypeVar("T")


def changed(numbers: T, changes: Iterable[str]) -> T:
    """Copy a dataclass, some of whose fields may be dataclasses, with numbers changed.

    Parameters
    ----------
    numbers
        Its fields are numbers, truth values, tuples of one kind, or dataclasses of these.
    changes
        Each ``NAME=VALUE``: a value in JSON; one number stands for a tuple of it.

    Raises
    ------
    ValueError
        If there is no such number, or it is of another kind.
    """
    for change in changes:
        name, given = name_and_value(change, "rate=1e-3")
        own = _flat(numbers)
        known("hyperparameter", [name], own)
        several = isinstance(own[name], tuple)
        values = given if several and isinstance(given, list) else [given]
        kind = type(own[name][0] if several else own[name])
        kinds = {float, int} if kind is float else {kind}
        if not values or not kinds.issuperset(map(type, values)):
            raise ValueError(f"--set {change}: must be like {json.dumps(own[name])}")
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
