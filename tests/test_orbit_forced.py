"""Orbits with residual torques, near the motions of learned policies."""

from pathlib import Path

import numpy as np
import pytest

from skate_env import Policy, load_scene
from skate_env.common import wilson
from skate_env.gait import ORDER, step_orders
from skate_env.learning.rollouts import Conditions, run
from skate_env.policies import load, shipped
from skate_env.scenes import replace
from tests.commands import invoke
from training.orbits import feedback, forced, measure
from training.orbits.linear_quadratic import solve

TRAINING = Path(__file__).parents[1] / "training"
POLICY = TRAINING / "imitation" / "policies" / "push_only_order.npz"


@pytest.fixture(scope="module")
def learned():
    """Load a policy that keeps the paper's order on push-only ice, with all of tau2 to tau6."""
    return Policy.load(POLICY)


@pytest.fixture(scope="module")
def orbit(learned):
    return forced.find(replace(learned.scene, {"accuracy": "reference"}), learned)


@pytest.fixture(scope="module")
def designed(orbit, learned):
    return feedback.design(orbit, learned.action_scale, weight=3.0)


def test_the_orbit_is_closed_within_the_torques_of_the_policy(orbit, learned):
    assert orbit.size < 1e-9  # 8e-12
    limits = np.array(list(learned.action_scale.values()))
    assert (np.abs(orbit.start.torques) <= limits).all()


def test_further_cycles_repeat_the_first_at_every_sample(orbit):
    """Mirrored, with the torques on their joints when the legs swap within an action: 7e-9."""
    strobe, start = orbit.strobe, orbit.start
    strobe.sim.restore(start.snapshot)
    states = [strobe.state]
    for tick in range(1, 2 * start.samples):
        strobe.advance(start, (start.tick + tick) * start.period)
        states.append(strobe.state)
    moving = slice(1, 2 * strobe.n)
    first, second = np.split(np.array(states), 2)
    assert np.abs(second @ strobe.back(1).T - first)[:, moving].max() < 1e-6


def test_it_is_the_order_with_double_support_and_admissible_forces(orbit):
    """Each state of the order after the one before it, others between them; 469 ms of support."""
    strobe, start = orbit.strobe, orbit.start
    sim = strobe.sim
    strobe.at(start)
    sim.take_steps()
    sim.take_events()
    strobe.advance(start, (start.tick + 2 * start.samples) * start.period)
    steps = sim.take_steps()
    swaps = [step["time"] for step in steps]
    _, made = step_orders(sim.take_events(), [start.tick * start.period, *swaps])
    assert made.reached == len(ORDER)
    assert made.double > 0.03
    assert all(step["inadmissible_time"] == 0.0 for step in steps)


def test_on_the_orbit_the_actions_are_those_of_the_orbit(orbit, designed):
    """Largest deviation 1e-4: observations are in single precision."""
    strobe, start = orbit.strobe, orbit.start
    strobe.at(start)
    for action in range(2 * len(start.torques)):
        chosen = designed.residual(strobe.sim)
        assert np.abs(chosen - strobe.torque(start)).max() < 0.1
        end = (action + 1) * start.samples // len(start.torques)
        strobe.advance(start, (start.tick + end) * start.period)


def test_the_feedback_contracts_what_the_orbit_expands(orbit, designed):
    """A deviation of 1e-3 in rad and rad/s grows by 2.7 a step, and decays with the feedback."""
    strobe, start, sim = orbit.strobe, orbit.start, orbit.strobe.sim
    noise = np.zeros(len(strobe.mirror))
    noise[2 : 2 * strobe.n] = 1e-3 * np.random.default_rng(0).normal(size=2 * strobe.n - 2)
    sim.restore(strobe.displaced(start, noise).snapshot)
    number = len(start.torques)
    for action in range(6 * number):
        torque = designed.residual(sim)
        end = (action + 1) * start.samples // number
        assert sim.advance((start.tick + end) * start.period, torque)
    moving = slice(1, 2 * strobe.n)
    left = (strobe.back(6) @ strobe.state - strobe.at(start))[moving]
    assert np.abs(left).max() < 2e-3
    assert np.abs(np.linalg.eigvals(orbit.derivative.P)).max() > 2.0


@pytest.mark.long("100 steps from 8 starts")
def test_the_feedback_keeps_the_order(designed):
    """From 100 % of 32 starts (89 to 100), all steps in order, 30 ms in all."""
    conditions = Conditions(episodes=8, disturbances={"perturb": 0.01, "trunk_noise": 0.01})
    measured = run(designed, designed.environment(), conditions)
    # Wilson's interval of 95 %: of 8 of 8 it begins at 0.68, of 7 of 8 at 0.53.
    assert wilson(int(measured["completed"].sum()), 8)[0] > 0.6
    assert measured["in_order"].mean() > 0.9
    assert measured["long_heel_and_flat"].mean() > 0.9
    assert measured["inadmissible"].max() == 0.0


@pytest.mark.long("closes an orbit of push_only")
def test_the_orbit_of_the_shipped_policy_of_push_only():
    """Decay over ten steps within 5e-6 of the prediction."""
    policy = Policy.load(shipped("push_only"))
    orbit = forced.find(replace(load_scene("push_only"), {"accuracy": "reference"}), policy)
    assert orbit.size < 1e-9
    assert measure.decay(orbit).errors.max() < 0.02


@pytest.mark.long("20 steps from 32 starts")
def test_the_feedback_returns_from_perturbed_starts_and_kicks():
    """99.4 % of 320 starts perturbed by 0.05 (97.8 to 99.8), 100 % of 64 with kicks (94 to 100)."""
    policy = Policy.load(TRAINING / "benchmark" / "push_only_seed_1.npz")
    scene = replace(load_scene("push_only"), {"accuracy": "reference"})
    designed = feedback.design(forced.find(scene, policy), policy.action_scale, weight=0.3)
    for disturbances in ({"perturb": 0.05}, {"perturb": 0.02, "kick": 0.6}):
        conditions = Conditions(episodes=32, steps=20, disturbances=disturbances)
        measured = run(designed, designed.environment(), conditions)
        # Of 31 of 32 the interval begins at 0.843, of 30 at 0.799.
        assert wilson(int(measured["completed"].sum()), 32)[0] > 0.84
        assert measured["inadmissible"].max() == 0.0


def test_a_motion_that_ends_is_named():
    policy = Policy.load(shipped("push_only"))
    slippery = {"accuracy": "reference", "ice.friction.mu_backward": 0.01}
    scene = replace(load_scene("push_only"), slippery)
    with pytest.raises(ValueError, match=r"with the policy: fall after"):
        forced.find(scene, policy)


def test_the_command_writes_the_feedback(orbit, designed, monkeypatch, tmp_path):
    monkeypatch.setattr(forced, "find", lambda scene, policy: orbit)
    path = tmp_path / "feedback.npz"
    arguments = ["--policy", str(POLICY), "--torque-weight", "3", "--feedback", str(path)]
    result = invoke("orbit", *arguments)
    assert result.exit_code == 0, result.output
    assert "push_only_order: unstable orbit of 1 gait step(s), 710 samples" in result.stdout
    assert (load(path).gains == designed.gains).all()


def test_the_recursion_solves_the_linear_quadratic_problem():
    """Its inputs are a minimum: the cost, a quadratic one, is even about them. 1e-13 of it."""
    rng = np.random.default_rng(0)
    k, s, m = 5, 4, 2
    A, B = rng.normal(size=(k, s, s)), rng.normal(size=(k, s, m))
    Q, R, end = (np.diag(rng.uniform(0.5, 2.0, size)) for size in (s, m, s))
    slope, x = rng.normal(size=(2, s))
    K, offsets = solve(list(A), list(B), Q, R, end, slope)

    def cost(inputs):
        state, total = x, 0.0
        for a, b, u in zip(A, B, inputs, strict=True):
            total += 0.5 * (state @ Q @ state + u @ R @ u)
            state = a @ state + b @ u
        return total + 0.5 * state @ end @ state + slope @ state

    inputs, state = [], x
    for a, b, gain, offset in zip(A, B, K, offsets, strict=True):
        inputs.append(-gain @ state - offset)
        state = a @ state + b @ inputs[-1]
    best = np.array(inputs)
    for direction in rng.normal(size=(20, k, m)):
        both = [cost(best + sign * direction) for sign in (1.0, -1.0)]
        assert min(both) > cost(best)
        assert abs(both[0] - both[1]) < 1e-9 * abs(both[0])
