"""Ranges of the hyperparameters of trainings."""

import json
from dataclasses import fields, replace
from typing import get_args, get_type_hints

import pytest

from skate_env.cli.options import name_and_value
from skate_env.learning.configs import CONFIGS, Hyperparameters
from skate_env.learning.overrides import Range, override

RANGES = {
    name: get_args(hint)[1]
    for name, hint in get_type_hints(Hyperparameters, include_extras=True).items()
}


def test_every_number_has_a_finite_range():
    assert set(RANGES) == {field.name for field in fields(Hyperparameters)}
    for within in RANGES.values():
        assert isinstance(within, Range) and -1e12 <= within.low < within.high <= 1e12
    # The values of the scenes are within them: otherwise the import fails.
    assert CONFIGS


@pytest.mark.parametrize("name", RANGES)
def test_numbers_out_of_range_are_refused_with_the_range(refused, name):
    low, high = RANGES[name].low, RANGES[name].high
    for wrong in (low - 1, high + 1, -(10**400), 10**400, float("inf"), None, "1", True, [1j]):
        if isinstance(getattr(Hyperparameters(), name), tuple) and wrong == [1j]:
            continue
        refused(ValueError, lambda wrong=wrong: override(Hyperparameters(), [(name, wrong)]), name)
    refused(
        ValueError,
        lambda: override(Hyperparameters(), [(name, int(high) + 1)]),
        f"{name} = {int(high) + 1}: must lie in",
    )


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"minibatch": 4097}, ["minibatch = 4097", "at most envs * rollout = 4096"]),
        ({"envs": 8}, ["minibatch = 2048", "envs * rollout = 512"]),
        ({"envs": 10_000, "rollout": 10_000}, ["envs * rollout = 100000000", "at most"]),
        ({"layers": [4096, 4096]}, ["layers = [4096, 4096]", "weights"]),
        ({"layers": [64] * 17}, ["layers", "1 to 16 numbers"]),
        ({"rate": "1e400"}, ["rate = '1e400'", "real number"]),
    ],
)
def test_numbers_must_fit_each_other(refused, changes, words):
    refused(ValueError, lambda: override(Hyperparameters(), changes.items()), *words)


def test_a_number_without_digits_is_refused(refused):
    given = [name_and_value(text, "") for text in ("rate=1e400", "gamma=NaN")]
    for each in given:
        refused(ValueError, lambda each=each: override(Hyperparameters(), [each]), each[0])


def test_a_direct_construction_is_checked(refused):
    refused(ValueError, lambda: Hyperparameters(actions=0), "actions = 0: must lie in [1, ")
    refused(TypeError, lambda: replace(Hyperparameters(), actions="1"), "actions")
    assert json.dumps(Hyperparameters().layers) == "[64, 64]"
