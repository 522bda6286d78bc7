"""Sensitivities of a gait: laws, and the command."""

import json

import numpy as np
import pytest

from skate_env import Simulator, load_scene
from skate_env.scenes import replace
from tests.commands import invoke
from training import sensitivity as study
from training.sensitivity import QUANTITIES, parameters

# Friction, gravity, a mass, a length, a gain, a torque.
FEW = (
    "ice.friction.mu_forward",
    "ice.gravity",
    "body.head.mass",
    "body.lower_leg.length",
    "control.lifting.height",
    "control.feedforward.scale",
    "control.feedforward.tau1_scale",
)


# Steps of the differences, relative to the parameter, largest first.
STEPS = [2e-4 * 8.0**-k for k in range(4)]
# Error of a quantity by rounding and by the tolerance, which the differences divide by the step.
NOISE = 1e-12


def measured(monkeypatch, name, names, **changes):
    """Measure the second step of a preset, for some parameters only."""
    scene = replace(load_scene(name), {"accuracy": "reference"} | changes)
    known = parameters(scene)
    monkeypatch.setattr(study, "parameters", lambda _: {name: known[name] for name in names})
    return study.measure(scene, 2)


def difference(found, name):
    """Central difference of order 4 (K,) with the step whose error is smallest.

    NaN where every change of the parameter changes the sequence of events or leaves its range.
    """
    value, sim = found.parameters[name], Simulator(found.scene)
    gait = study.walk(sim, found.steps)
    best, least = np.full(len(QUANTITIES), np.nan), np.inf
    for step in (relative * abs(value) for relative in STEPS):
        if NOISE / step > least:
            break
        ends = []
        for k in (-2, -1, 1, 2):
            try:
                sim.reset(params={name: value + k * step})
            except ValueError:  # Outside the parameter's range.
                break
            changed = study.walk(sim, found.steps)
            if changed is None or changed.sequence != gait.sequence:
                break
            ends.append(changed.values)
        else:
            near, far = ends[2] - ends[1], ends[3] - ends[0]
            by = (8.0 * near - far) / (12.0 * step)
            # Above the truncation of order 4; it also shows a kink between the points.
            error = np.abs(by - near / (2.0 * step)).max() + NOISE / step
            if error < least:
                best, least = by, error
    return best


def differences(found):
    """Differences of all parameters (K, M)."""
    return np.stack([difference(found, name) for name in found.parameters], axis=1)


def deviation(found):
    """Deviations from the differences, relative to the largest number of each quantity (K, M)."""
    size = np.abs(found.relative).max(axis=1, keepdims=True)
    off = (found.derivatives - differences(found)) * [*found.parameters.values()]
    return np.abs(off / found.values[:, None] / size)


def check(found):
    """Largest deviation 2e-7 of the largest number."""
    assert deviation(found).max() < 1e-5


def test_derivatives_agree_with_differences(monkeypatch):
    check(measured(monkeypatch, "paper_arms", FEW))


@pytest.mark.long("a longer step")
def test_derivatives_of_the_paper_agree_with_differences(monkeypatch):
    check(measured(monkeypatch, "paper", FEW))


def test_a_limit_that_the_motion_does_not_reach_has_no_effect(monkeypatch):
    found = measured(monkeypatch, "paper_arms", ["fall.head_height"])
    assert (found.derivatives == 0.0).all() and (differences(found) == 0.0).all()


def test_a_parameter_at_the_end_of_its_range(monkeypatch):
    """Differences need both sides; the derivative is continuous: 0.4 % apart."""
    inside = measured(monkeypatch, "paper_arms", ["control.psi"], **{"control.psi": 0.9999})
    check(inside)
    at_end = measured(monkeypatch, "paper_arms", ["control.psi"])
    assert at_end.parameters == {"control.psi": 1.0} and np.isnan(differences(at_end)).all()
    np.testing.assert_allclose(at_end.derivatives, inside.derivatives, rtol=1e-2)


@pytest.mark.long("all parameters")
def test_all_parameters_agree_with_differences(monkeypatch):
    """All but psi, which is at the end of its range, have differences."""
    names = list(parameters(load_scene("paper")))
    off = deviation(measured(monkeypatch, "paper", names)).max(axis=0)
    assert np.flatnonzero(~(off < 1e-5)).tolist() == [names.index("control.psi")]


def test_the_command_ranks(monkeypatch):
    known = parameters(load_scene("paper_arms"))
    few = {name: known[name] for name in FEW[:3]}
    monkeypatch.setattr(study, "parameters", lambda _: few)
    result = invoke("sensitivity", "--scene", "paper_arms", "--json")
    assert result.exit_code == 0, result.output
    *table, last = result.stdout.splitlines()
    summary = json.loads(last)
    effects = [
        max(abs(x) for x in each["relative"].values()) for each in summary["parameters"].values()
    ]
    assert effects == sorted(effects, reverse=True) and len(effects) == 3
    assert [row.split()[0] for row in table[-3:]] == list(summary["parameters"])
    assert set(summary["quantities"]) == set(QUANTITIES)


@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        (["--accuracy", "fast"], "accuracy"),
        (["--accuracy", "balanced"], "choose the accuracy reference"),
        (["--scene", "push_only", "--steps", "100"], "ends before step 100"),
        (["--scene", "nowhere"], "nowhere"),
    ],
)
def test_bad_arguments_are_named(arguments, word):
    result = invoke("sensitivity", *arguments)
    assert result.exit_code == 2
    assert word in result.stderr
