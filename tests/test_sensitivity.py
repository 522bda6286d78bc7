"""Sensitivities of a gait: laws, and the command."""

import json

import numpy as np
import pytest

from skate_env import load_scene
from skate_env.scenes import replace
from tests.commands import invoke
from training.sensitivity import study
from training.sensitivity.study import QUANTITIES, parameters

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


def measured(monkeypatch, name, names, **changes):
    """Measure the second step of a preset, for some parameters only."""
    scene = replace(load_scene(name), {"accuracy": "reference"} | changes)
    known = parameters(scene)
    monkeypatch.setattr(study, "parameters", lambda _: {name: known[name] for name in names})
    return study.measure(scene, 2, lambda _: None)


def check(found):
    """Largest deviation 2e-7 of the largest number."""
    assert np.isfinite(found.differences).all()
    size = np.abs(found.relative).max(axis=1, keepdims=True)
    assert np.abs(found.errors / size).max() < 1e-5


def test_derivatives_agree_with_differences(monkeypatch):
    check(measured(monkeypatch, "paper_arms", FEW))


@pytest.mark.long("a longer step")
def test_derivatives_of_the_paper_agree_with_differences(monkeypatch):
    check(measured(monkeypatch, "paper", FEW))


def test_a_limit_that_the_motion_does_not_reach_has_no_effect(monkeypatch):
    found = measured(monkeypatch, "paper_arms", ["fall.head_height"])
    assert (found.derivatives == 0.0).all() and (found.differences == 0.0).all()


def test_a_parameter_at_the_end_of_its_range(monkeypatch):
    """Differences need both sides; the derivative is continuous: 0.4 % apart."""
    inside = measured(monkeypatch, "paper_arms", ["control.psi"], **{"control.psi": 0.9999})
    check(inside)
    at_end = measured(monkeypatch, "paper_arms", ["control.psi"])
    assert at_end.parameters == {"control.psi": 1.0} and np.isnan(at_end.differences).all()
    np.testing.assert_allclose(at_end.derivatives, inside.derivatives, rtol=1e-2)


@pytest.mark.long("all parameters")
def test_the_command_without_options():
    """All but psi, which is at the end of its range, have differences."""
    result = invoke("sensitivity")
    assert result.exit_code == 0, result.output
    count = len(parameters(load_scene("paper")))
    heading = " ".join(result.stdout.split())
    assert (
        f"Of {count} parameters {count - 1} agree" in heading
        and "; 1 without differences" in heading
    )


def test_the_command_ranks_and_writes(monkeypatch, tmp_path):
    known = parameters(load_scene("paper_arms"))
    few = {name: known[name] for name in FEW[:3]}
    monkeypatch.setattr(study, "parameters", lambda _: few)
    arguments = ["--scene", "paper_arms", "--json", "--out", str(tmp_path)]
    result = invoke("sensitivity", *arguments)
    assert result.exit_code == 0, result.output
    summary = json.loads(result.stdout.splitlines()[-1])
    assert json.loads((tmp_path / "sensitivity.json").read_text()) == summary
    effects = [
        max(abs(x) for x in each["relative"].values()) for each in summary["parameters"].values()
    ]
    assert effects == sorted(effects, reverse=True) and len(effects) == 3
    assert set(summary["quantities"]) == set(QUANTITIES)
    assert {path.name for path in tmp_path.iterdir()} == {
        "sensitivity.json",
        "sensitivity.md",
        "sensitivity.png",
    }


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
