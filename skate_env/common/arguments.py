"""Validation of the arguments of the environments; errors name the argument."""

from collections.abc import Iterable, Mapping
from numbers import Real
from typing import Any

import numpy as np
from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray

from .messages import shown

_OPTIONS = ("state", "params", "phase", "perturb")
_STATE = ("q", "v", "support_leg")


def array_of(name: str, given: Any) -> NDArray[Any]:
    """Convert to an array of any type; raise ValueError for what is none."""
    try:
        return np.asarray(given)
    # The conversion may run the object's own code, which may raise anything.
    except Exception as error:
        raise ValueError(f"{name}: not an array of numbers: {shown(error)}") from None


def items(name: str, given: Any) -> list[Any]:
    """List what an object contains; raise ValueError for an object that contains nothing."""
    try:
        return list(given)
    except Exception as error:
        raise ValueError(f"{name}: not a list: {shown(error)}") from None


def checked(name: str, given: Any, shape: tuple[int | str, ...]) -> NDArray[np.float64]:
    """Convert to an array of finite real numbers of a shape, row by row; errors as of `finite`."""
    return finite(name, given, shape).astype(np.float64, order="C")


def finite(name: str, given: Any, shape: tuple[int | str, ...]) -> NDArray[Any]:
    """Check an array of finite real numbers; a letter in the shape is any length.

    Only numbers of more than eight bytes are converted.

    Raises
    ------
    TypeError
        If it does not consist of real numbers.
    ValueError
        If it has another shape, or a number is not finite.
    """
    array = array_of(name, given)
    wanted = f"{' x '.join(map(str, shape))} real numbers"
    if array.dtype.kind not in "fiu":
        raise TypeError(f"{name} has dtype {array.dtype}: must be {wanted}")
    fits = array.ndim == len(shape) and all(
        isinstance(size, str) or size == found
        for size, found in zip(shape, array.shape, strict=True)
    )
    if not fits:
        sizes = ", ".join(map(str, shape)) + "," * (len(shape) == 1)
        raise ValueError(f"{name} has shape {array.shape}: must be ({sizes})")
    if array.dtype.itemsize > np.dtype(np.float64).itemsize:
        with np.errstate(all="ignore"):
            array = array.astype(np.float64)
    valid = np.isfinite(array)
    if not valid.all():
        bad = tuple(np.argwhere(~valid)[0].tolist())
        raise ValueError(f"{name}{list(bad)} = {array[bad]}: must be finite")
    return array


def seed_of(given: object) -> int | None:
    """Check a seed, or None.

    Raises
    ------
    TypeError, ValueError
        If it is neither None nor an int from 0 to 2**64 - 1.
    """
    if given is None:
        return None
    if isinstance(given, bool) or not isinstance(given, int | np.integer):
        raise TypeError(
            f"seed = {shown(given)}: must be an int or None, not {type(given).__name__}"
        )
    if not 0 <= given < 2**64:
        raise ValueError(f"seed = {shown(given)}: must lie in [0, 2**64 - 1]")
    return int(given)


def whole(name: str, given: object) -> int:
    """Check a whole number; raise TypeError for other types."""
    if isinstance(given, bool) or not isinstance(given, int | np.integer):
        raise TypeError(f"{name} = {shown(given)}: must be an int, not {type(given).__name__}")
    return int(given)


def count(name: str, given: object) -> int:
    """Check a whole number of at least 1.

    Raises
    ------
    TypeError, ValueError
        If it is not such a number.
    """
    number = whole(name, given)
    if number < 1:
        raise ValueError(f"{name} = {shown(given)}: must be at least 1")
    return number


def action_limit(given: object) -> int | None:
    """Check ``max_episode_steps``: a count; None, or -1 as in `gymnasium.make`, for no limit."""
    name = "max_episode_steps"
    return None if given is None or whole(name, given) == -1 else count(name, given)


def autoreset(given: object) -> AutoresetMode:
    """Convert to an autoreset mode.

    Raises
    ------
    ValueError
        If it is neither a mode nor the value of one.
    """
    try:
        return AutoresetMode(given)
    # The message of the enumeration repeats the value, which may contain itself.
    except (ValueError, RecursionError):
        known = ", ".join(repr(mode.value) for mode in AutoresetMode)
        raise ValueError(f"autoreset_mode = {shown(given)}: must be one of {known}") from None


def reset_mask(given: object, n: int) -> NDArray[np.bool_]:
    """Check ``options["reset_mask"]``, the environments to reset; None for all.

    Raises
    ------
    TypeError, ValueError
        If it is not an array (n,) of bool, or all elements are false.
    """
    if given is None:
        return np.ones(n, np.bool_)
    if not isinstance(given, np.ndarray) or given.dtype != np.bool_:
        kind = given.dtype if isinstance(given, np.ndarray) else type(given).__name__
        raise TypeError(f"reset_mask: must be a numpy array of bool, not {kind}")
    if given.shape != (n,):
        raise ValueError(f"reset_mask has shape {given.shape}: must be ({n},)")
    if not given.any():
        raise ValueError("reset_mask names no environment: at least one must be true")
    return given


def elapsed_actions(given: object, n: int) -> list[int]:
    """Check ``options["elapsed"]``, numbers of actions that count as made; None for zeros.

    Raises
    ------
    TypeError, ValueError
        If it is not an array (n,) of int, or an element is negative.
    """
    if given is None:
        return [0] * n
    array = array_of("elapsed", given)
    if array.dtype.kind not in "iu":
        raise TypeError(f"elapsed has dtype {array.dtype}: must be {n} ints")
    if array.shape != (n,):
        raise ValueError(f"elapsed has shape {array.shape}: must be ({n},)")
    if (array < 0).any():
        raise ValueError(f"elapsed = {array.min()}: must be at least 0")
    return [int(x) for x in array]


def table(name: str, given: Any) -> dict[str, Any]:
    """Copy a dict; raise TypeError for other types."""
    if not isinstance(given, Mapping):
        raise TypeError(f"{name} = {shown(given)}: must be a dict, not {type(given).__name__}")
    return dict(given)


def reset_arguments(options: Mapping[str, Any]) -> dict[str, Any]:
    """Convert the options of a reset to arguments of `Batch.reset`, which checks their values.

    Raises
    ------
    TypeError, ValueError
        If an option or a part of a state has an unknown name, or a state is not a dict.
    """
    known("option", options, _OPTIONS)
    arguments = {name: value for name, value in options.items() if name != "state"}
    state = options.get("state")
    if state is None:
        return arguments
    if not isinstance(state, Mapping):
        raise TypeError(f"state = {shown(state)}: must be a dict of {', '.join(_STATE)}")
    known("part of state", state, _STATE)
    return arguments | dict(state)


def known(what: str, given: Iterable[str], names: Iterable[str]) -> None:
    """Raise ValueError for an unknown name; the message lists the valid ones."""
    for name in given:
        if name not in names:
            raise ValueError(f"unknown {what} {shown(name)}: must be one of {', '.join(names)}")


def real(name: str, given: Any) -> float:
    """Convert a real number to float.

    Raises
    ------
    TypeError, ValueError
        If it is not a real number, or too large for a float.
    """
    if isinstance(given, bool) or not isinstance(given, Real):
        raise TypeError(
            f"{name} = {shown(given)}: must be a real number, not {type(given).__name__}"
        )
    try:
        return float(given)
    except Exception as error:
        raise ValueError(f"{name}: no floating-point number: {shown(error)}") from None


def between(name: str, given: Any, low: float, high: float) -> float:
    """Convert a real number to float.

    Raises
    ------
    TypeError, ValueError
        If it is not a real number, or not in [low, high].
    """
    number = real(name, given)
    if not low <= number <= high:
        raise ValueError(f"{name} = {given}: must lie in [{low:.16g}, {high:.16g}]")
    return number
