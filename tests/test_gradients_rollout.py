"""Derivatives of rollouts: jvp, vjp and the function for PyTorch."""

import copy

import numpy as np
import pytest

from skate_env import Mirror, Simulator, gradients, load_scene
from skate_env.scenes import replace


def started(accuracy="balanced", seconds=0.0):
    sim = Simulator(replace(load_scene("paper_damped"), {"accuracy": accuracy}))
    if seconds > 0.0:
        sim.advance(seconds)
    return sim


def random_torques(sim, actions):
    return np.random.default_rng(0).uniform(-3.0, 3.0, (actions, len(sim.q) - 3))


def test_a_rollout_has_the_states_of_its_steps():
    sim, other = started(), started()
    torques = random_torques(sim, 20)
    done = gradients.rollout(sim, torques)
    for k, torque in enumerate(torques):
        assert (done.states[k] == other.state_vector()).all()
        other.step(torque)
    assert (done.states[-1] == other.state_vector()).all()
    assert (sim.state_vector() == other.state_vector()).all()


def test_vjp_equals_jvp():
    """The products of weights and of directions agree to rounding."""
    sim = started()
    torques = random_torques(sim, 40)
    done = gradients.rollout(sim, torques)
    rng = np.random.default_rng(1)
    dx, du = rng.normal(size=done.A.shape[1]), rng.normal(size=torques.shape)
    weights = rng.normal(size=done.states.shape)
    forward = weights * done.jvp(dx, du)
    start, by_torque = done.vjp(weights)
    backward = (start * dx).sum() + (by_torque * du).sum()
    assert abs(forward.sum() - backward) < 1e-13 * np.abs(forward).sum()


def test_jvp_agrees_with_linearize_over_the_whole():
    """One motion with other steps, at the tolerance of reference: 4e-8."""
    sim = started("reference")
    torque = random_torques(sim, 1)[0]
    whole = sim.linearize(torque, 0.3)
    done = gradients.rollout(sim, np.tile(torque, (30, 1)))
    dx = np.random.default_rng(2).normal(size=len(whole.A))
    exact = whole.A @ dx
    assert np.abs(done.jvp(dx)[-1] - exact).max() < 1e-6 * np.abs(exact).max()


def test_derivatives_stay_finite_over_100_actions():
    sim = started("balanced")
    done = gradients.rollout(sim, np.zeros((100, len(sim.q) - 3)))
    assert np.isfinite(done.A).all() and np.isfinite(done.B).all()
    assert all(np.isfinite(part).all() for part in done.vjp(np.ones(done.states.shape)))


def test_shapes_are_checked():
    sim = started()
    with pytest.raises(ValueError, match="torques"):
        gradients.rollout(sim, np.zeros((3, 2)))
    done = gradients.rollout(sim, random_torques(sim, 2))
    with pytest.raises(ValueError, match="weights"):
        done.vjp(np.zeros(3))
    with pytest.raises(ValueError, match="dx"):
        done.jvp(np.zeros(3))


@pytest.mark.parametrize(
    "seconds",
    [pytest.param(0.0, marks=pytest.mark.long("the same between events")), 0.3],
    ids=["smooth", "events"],
)
def test_gradcheck(seconds):
    """Torch's comparison with differences; the second start passes events of the free foot."""
    torch = pytest.importorskip("torch")
    from skate_env.torch import rollout

    sim = started({"method": "dopri5", "tolerance": 1e-12}, seconds)
    torques = torch.tensor(random_torques(sim, 4), requires_grad=True)

    def final(torques):
        return rollout(copy.copy(sim), torques)[-1, : len(sim.q)]

    assert torch.autograd.gradcheck(final, (torques,), eps=1e-3, atol=1e-7, rtol=1e-5)
    start = torch.tensor(sim.state_vector(), requires_grad=True)
    states = rollout(copy.copy(sim), torques, start)
    states[-1].sum().backward()
    done = gradients.rollout(copy.copy(sim), torques.detach().numpy())
    weights = np.zeros(done.states.shape)
    weights[-1] = 1.0
    by_start, by_torque = done.vjp(weights)
    assert np.abs(start.grad.numpy() - by_start).max() < 1e-6 * np.abs(by_start).max()
    assert np.abs(torques.grad.numpy() - by_torque).max() < 1e-6


@pytest.mark.parametrize("name", ["paper_arms", "paper_damped", "unilateral"])
def test_mirrored_states_have_mirrored_derivatives(name):
    """Rounding of the derivatives of RNEA grows to 7e-12 of the largest entry in 0.3 s."""
    sims = [Simulator(replace(load_scene(name), {"accuracy": "balanced"})) for _ in range(2)]
    mirror, n = Mirror(sims[0].coordinate_names), len(sims[0].q)
    rng = np.random.default_rng(3)
    q, v = sims[0].q, sims[0].v
    q[9:] += rng.normal(0.0, 0.05, n - 9)
    torque = rng.uniform(-3.0, 3.0, n - 3)
    sims[0].reset(q, v, "left")
    sims[1].reset(mirror(q), mirror(v), "right")
    # The mirror as matrices: of positions, of the whole state, of the torques.
    coordinates = np.array([mirror(row) for row in np.eye(n)]).T
    state = np.eye(2 * n + 4)
    state[:n, :n] = state[n : 2 * n, n : 2 * n] = coordinates
    joints = coordinates[3:, 3:]
    lin, mirrored = sims[0].linearize(torque, 0.3), sims[1].linearize(joints @ torque, 0.3)
    assert len(lin.events) > 0
    assert [e["time"] for e in lin.events] == [e["time"] for e in mirrored.events]
    for found, exact in (
        (mirrored.A @ state, state @ lin.A),
        (mirrored.B @ joints, state @ lin.B),
    ):
        assert np.abs(found - exact).max() < 1e-10 * np.abs(exact).max()
