"""Derivatives of rollouts: jvp, vjp and the function for PyTorch."""

import copy

import numpy as np
import pytest

from skate_env import Mirror, Simulator, gradients, load_scene
from skate_env.scenes import replace
from skate_env.studies.fixtures import PAPER_DAMPED


def started(accuracy="balanced", seconds=0.0):
    sim = Simulator(replace(load_scene(PAPER_DAMPED), {"accuracy": accuracy}))
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


@pytest.mark.parametrize("name", ["paper_arms", PAPER_DAMPED, "push_only"])
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


def test_a_refused_rollout_changes_nothing(refused):
    sim = started()
    joints, size = len(sim.q) - 3, len(sim.state_vector())
    before, bad = sim.snapshot(), np.zeros((5, joints))
    bad[3, 1] = np.nan
    refused(ValueError, lambda: gradients.rollout(sim, bad), "torques[3, 1] = nan", "finite")
    for wrong in (bad.astype(str), bad > 0.0, bad.astype(complex), [[10**400] * joints], None):
        refused(TypeError, lambda wrong=wrong: gradients.rollout(sim, wrong), "torques has dtype")
    # NaN of the start, and a fall after some actions.
    start = np.full(size, np.nan)
    refused(ValueError, lambda: gradients.rollout(sim, np.zeros((2, joints)), start), "start[0]")
    fall = np.full((200, joints), 1e4)
    refused(ValueError, lambda: gradients.rollout(sim, fall))
    assert sim.snapshot() == before


def test_a_start_is_that_of_a_displaced_simulator():
    sim, other = started(), started()
    torques = random_torques(sim, 3)
    start = sim.state_vector()
    start[5] += 1e-3
    other.displace(start - other.state_vector())
    assert (
        gradients.rollout(sim, torques, start).states == gradients.rollout(other, torques).states
    ).all()
    assert sim.snapshot() == other.snapshot()


def test_events_of_a_rollout_can_be_taken():
    sim, other = started(seconds=0.3), started(seconds=0.3)
    torques = np.zeros((20, len(sim.q) - 3))
    gradients.rollout(sim, torques)
    for torque in torques:
        other.step(torque)
    events = sim.take_events()
    assert events and events == other.take_events()


def test_weights_and_variations_are_finite_real_numbers(refused):
    done = gradients.rollout(started(), np.zeros((2, 16)))
    size = done.A.shape[1]
    refused(ValueError, lambda: done.jvp(np.full(size, np.nan)), "dx[0] = nan")
    refused(TypeError, lambda: done.jvp(np.zeros(size, complex)), "dx has dtype complex")
    refused(TypeError, lambda: done.jvp(du=np.zeros((2, 16)).astype(str)), "du has dtype")
    refused(TypeError, lambda: done.vjp(None), "weights has dtype")
    refused(ValueError, lambda: done.vjp(np.full((3, size), np.inf)), "weights[0, 0] = inf")


def test_tensors_of_a_wrong_kind_are_refused(refused):
    torch = pytest.importorskip("torch")
    from skate_env.torch import rollout

    sim = started()
    before, torques = sim.snapshot(), torch.zeros(2, 16)
    moved = torch.as_tensor(sim.state_vector()) + 0.01
    for call, kind, word in (
        (lambda: rollout(sim, torques, torch.ones(1)), ValueError, "start has shape (1,)"),
        (lambda: rollout(sim, torch.zeros(2, 3), moved), ValueError, "torques has shape"),
        (lambda: rollout(sim, torques.to(torch.int64)), TypeError, "torch.int64"),
        (lambda: rollout(sim, torques, torch.zeros(42, dtype=torch.bool)), TypeError, "start"),
        (lambda: rollout(sim, torques.numpy()), TypeError, "torques: must be a tensor"),
        (lambda: rollout(None, torques), TypeError, "must be a Simulator"),
    ):
        refused(kind, call, word)
    assert sim.snapshot() == before
