"""Periodic orbits of gaits: laws of the closed orbits, and the command."""

import json
from dataclasses import replace

import numpy as np
import pytest

from skate_env import load_scene
from skate_env.scenes import replace as changed
from skate_env.studies.fixtures import BLADE, PAPER_DAMPED
from tests.commands import invoke
from training.orbits import close, measure
from training.orbits.strobe import Start


def closed(name):
    """Close the orbit of a preset at `reference`."""
    return close.find(changed(load_scene(name), {"accuracy": "reference"}))


@pytest.fixture(scope="module")
def arms():
    return closed("paper_arms")


@pytest.fixture(scope="module")
def multipliers(arms):
    return np.linalg.eigvals(arms.derivative.P)


def largest(multipliers, count=12):
    """Largest multipliers in magnitude, in an order that rounding does not change."""
    kept = multipliers[np.argsort(-np.abs(multipliers))[:count]]
    return kept[np.lexsort((kept.imag.round(4), kept.real.round(4)))]


def test_the_orbit_is_closed(arms):
    """Residual 8e-11; a second cycle adds as much."""
    assert arms.size < 1e-9
    assert not arms.tuned
    twice = replace(arms.start, steps=2, samples=2 * arms.start.samples)
    assert np.abs(arms.strobe.residual(twice)[arms.derivative.kept]).max() < 2e-9


def test_the_scene_reaches_the_orbit_by_itself(arms):
    """The period of the simulated steps is that of the orbit: within 1e-9 s after 60 s."""
    sim = arms.strobe.sim
    sim.reset()
    sim.take_steps()
    while sim.time < 60.0:
        sim.step()
    periods = [step["period"] for step in sim.take_steps()]
    assert abs(periods[-1] - arms.start.duration) < 1e-8


def test_two_steps_have_the_product_of_the_derivatives(arms):
    """Deviation 5e-7 of the largest entry: other steps of the integrator."""
    twice = replace(arms.start, steps=2, samples=2 * arms.start.samples)
    P = arms.derivative.P
    squared = arms.strobe.derivative(twice).P
    assert np.abs(squared - P @ P).max() < 1e-5 * np.abs(squared).max()


def test_multipliers_do_not_depend_on_the_section(arms, multipliers):
    """Another start on the same orbit has the same multipliers: deviation 3e-7."""
    strobe, start = arms.strobe, arms.start
    for later in (100, 250):
        strobe.at(start)
        tick = start.tick + later
        strobe.sim.advance(tick * start.period)
        moved = Start(strobe.sim.snapshot(), tick, start.period, 1, start.samples)
        found = largest(np.linalg.eigvals(strobe.derivative(moved).P))
        assert np.abs(found - largest(multipliers)).max() < 1e-5


def test_translation_changes_nothing(arms):
    along = np.zeros(len(arms.residual))
    along[0] = along[2 * arms.strobe.n] = 0.5
    moved = arms.strobe.displaced(arms.start, along)
    assert np.abs(arms.strobe.residual(moved)[arms.derivative.kept]).max() < 1e-9


def test_deviations_decay_as_predicted(arms):
    """Largest deviation 6e-6 over ten steps."""
    found = measure.decay(arms)
    assert len(found.errors) == 11
    assert found.errors.max() < 1e-3


def test_small_perturbations_return_and_large_ones_do_not(arms):
    size = measure.returning(arms, 0)
    assert 0.01 < size < 0.32


def test_the_command_writes_all(arms, monkeypatch, tmp_path):
    monkeypatch.setattr(close, "find", lambda scene: arms)
    monkeypatch.setattr(measure, "DIRECTIONS", 1)
    arguments = ["--scene", "paper_arms", "--json", "--out", str(tmp_path)]
    result = invoke("orbit", *arguments)
    assert result.exit_code == 0, result.output
    summary = json.loads(result.stdout.splitlines()[-1])
    assert json.loads((tmp_path / "orbit.json").read_text()) == summary
    assert summary["samples"] == arms.start.samples
    assert summary["dimension"] == len(summary["multipliers"])
    assert max(summary["residual"].values()) == arms.size
    files = {path.name for path in tmp_path.iterdir()}
    assert files == {"orbit.json", "orbit.png"}


@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        (["--accuracy", "fast"], "accuracy"),
        (["--scene", "push_only"], "no orbit: fall after"),
        (["--scene", "nowhere"], "nowhere"),
    ],
)
def test_bad_arguments_are_named(arguments, word):
    result = invoke("orbit", *arguments)
    assert result.exit_code == 2
    assert word in result.stderr


@pytest.mark.long("orbits of three presets")
@pytest.mark.parametrize(
    ("name", "tuned", "stable"),
    [("paper", True, True), (PAPER_DAMPED, False, True), (BLADE, False, False)],
)
def test_orbits_of_presets(name, tuned, stable):
    """Residuals 1e-11 to 1e-10; decay 4e-6, 1e-4 and 1e-3."""
    orbit = closed(name)
    assert orbit.size < 1e-9
    assert orbit.tuned == tuned
    assert abs(orbit.start.period / orbit.strobe.period - 1.0) < 1e-3
    radius = np.abs(np.linalg.eigvals(orbit.derivative.P)).max()
    assert (radius < 1.0) == stable
    assert measure.decay(orbit).errors.max() < 0.02
