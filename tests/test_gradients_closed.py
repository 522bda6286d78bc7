"""Derivatives against closed forms: sliding to rest, free fall, landing.

Legs cannot be locked. A body with constant joint angles is exact nevertheless: constant torques
from inverse dynamics hold the joints while a foot slides, and no torque is needed in free fall.
"""

import copy

import numpy as np
import pytest

from skate_env import Simulator, load_scene
from skate_env.scenes import replace

RK4 = {"method": "rk4", "step": 0.001}
GRAVITY = 9.81
BARE = {
    "provenance": "test",
    "control.lifting": None,
    "control.feedforward": None,
    "fall": None,
    # With damping the light feet and hands are stiff: rounding errors grow up to the tolerance.
    "body.joint_damping": False,
}


def bare(accuracy, start, changes):
    """Build the paper's body without a controller, supported by the right leg."""
    fields = BARE | {"body.foot.toe": 0.18, "body.foot.heel": 0.10, "accuracy": accuracy}
    fields |= {"start": {"support_leg": "right", **start}} | changes
    return Simulator(replace(load_scene("paper_printed"), fields))


def close(found, exact, tolerance=1e-12):
    """Compare numbers, relative to the exact ones or 1."""
    assert (
        np.abs(np.subtract(found, exact)).max() < tolerance * np.maximum(1.0, np.abs(exact)).max()
    )


# --- sliding to rest ------------------------------------------------------------------------------

POSTURE = {"q2": 0.12, "q5": 0.5, "q6": -0.8, "q7": 0.3}
MU = {1.0: 0.3, -1.0: 0.9}


def sliding(speed, accuracy):
    """Slide on a flat foot with held torques.

    Returns the simulator, the torques, and their derivatives by friction and gravity.
    """
    sim = bare(
        accuracy,
        {"q": POSTURE, "v": {"y0": speed}},
        {
            "ice.friction.capture_speed": 0.0,
            "ice.friction.mu_forward": MU[1.0],
            "contact.foot_rotation": False,
        },
    )
    mu, way = MU[np.sign(speed)], np.sign(speed)
    # Inverse dynamics of the deceleration with constant joint angles.
    inertia, at_rest = sim.mass_matrix(sim.q)[3:, 0], np.zeros_like(sim.q)
    weight = sim.bias_forces(sim.q, at_rest)[3:] / GRAVITY
    by_gravity = weight - way * mu * inertia
    return sim, GRAVITY * by_gravity, (-way * GRAVITY * inertia, by_gravity)


@pytest.mark.parametrize("accuracy", ["balanced", "reference", RK4], ids=["5e-6", "1e-9", "rk4"])
@pytest.mark.parametrize("speed", [0.2, 0.1, -0.4, -1.0])
def test_sliding_to_rest(speed, accuracy):
    """Stop at v0 / (mu g) after v0^2 / (2 mu g), both ways: largest error 6e-13.

    The torques depend on friction and gravity, so these derivatives combine P and B.
    """
    sim, torque, (by_mu, by_gravity) = sliding(speed, accuracy)
    n, way, mu = len(sim.q), np.sign(speed), MU[np.sign(speed)]
    slowing = mu * GRAVITY
    friction = f"ice.friction.mu_{'forward' if speed > 0 else 'backward'}"
    stop = abs(speed) / slowing
    lin = sim.linearize(torque, stop + 1e-3, [friction, "ice.gravity"])
    (event,) = lin.events
    assert not lin.nonsmooth and sim.linearize(torque, 0.9 * stop).events == []
    close(event["time"], stop)
    close(lin.A[0, 0], 1.0)
    close(lin.A[0, n], abs(speed) / slowing)
    close(event["dt_dx"][n], way / slowing)
    for column, (torques, value) in enumerate(((by_mu, mu), (by_gravity, GRAVITY))):
        exact = -speed * abs(speed) / (2.0 * slowing * value), -stop / value
        parts = (
            np.append(lin.B[0] * torques, lin.P[0, column]),
            np.append(event["dt_du"] * torques, event["dt_dp"][column]),
        )
        for terms, value_known in zip(parts, exact, strict=True):
            # Rounding is relative to the terms, which are up to 3,000 times as large as their sum.
            assert abs(terms.sum() - value_known) < 1e-12 * max(1.0, np.abs(terms).sum())


def test_the_momentum_of_a_sliding_robot():
    """Friction mu N: d(p_y + mu p_z) / dt = -mu m g for every motion of the joints."""
    start = {"q": POSTURE, "v": {"y0": 2.0, "q2": 0.4, "q5": -1.0}}
    sim = bare(1e-13, start, {"ice.friction.mu_forward": MU[1.0]})
    torque = np.random.default_rng(0).uniform(-3.0, 3.0, len(sim.q) - 3)
    until, n = 0.02, len(sim.q)
    lin = sim.linearize(torque, until, ["ice.gravity", "ice.friction.mu_forward"])
    assert not lin.events
    end = copy.copy(sim)
    end.advance(until, torque)
    mass = sum(body["mass"] for body in sim.bodies())
    before, after = momentum_gradient(sim), momentum_gradient(end)
    along = np.array([1.0, MU[1.0]])
    tangent = lin.tangent_before
    scale = np.abs(after).max()
    assert np.abs(along @ (after @ lin.A - before) @ tangent).max() < 1e-10 * scale
    assert np.abs(along @ after @ lin.B).max() < 1e-10 * scale
    # By gravity, and by friction: p_z stays beside the derivative of p_y + mu p_z.
    close(along @ after @ lin.P[:, 0], -MU[1.0] * mass * until, 1e-10)
    gained = end.momentum(end.q, end.v)[1] - sim.momentum(sim.q, sim.v)[1]
    close(along @ after @ lin.P[:, 1], -mass * GRAVITY * until - gained, 1e-10)
    assert lin.A.shape == (2 * n + 4, 2 * n + 4)


def momentum_gradient(sim):
    """Differentiate the linear momentum (2,) by the state (2, s), by Fourier differences of q."""
    q, v, n = sim.q, sim.v, len(sim.q)
    gradient = np.zeros((2, 2 * n + 4))
    gradient[:, n : 2 * n] = np.array([sim.momentum(q, e)[:2] for e in np.eye(n)]).T
    for i, e in enumerate(np.eye(n)[2:], start=2):
        # A trigonometric polynomial of degree 1 in every angle.
        ends = [sim.momentum(q + s * np.pi / 2 * e, v)[:2] for s in (1.0, -1.0)]
        gradient[:, i] = (ends[0] - ends[1]) / 2.0
    return gradient


# --- free fall and landing ------------------------------------------------------------------------

FALLING = {
    "contact.law": "push_only",
    "contact.toe_contact": False,
    "ice.friction.capture_speed": 0.0,
}


# A gap has closed where it is smaller than the negative of this [m].
CLOSED = 1e-11


def falling(height, speed, tilt, changes=None, accuracy="balanced"):
    """Fall with constant joint angles; height of the sole's lower end [m], its tilt [rad]."""
    toe = height + max(0.0, 0.28 * np.sin(tilt))
    start = {"q": POSTURE | {"z0": toe, "q1": tilt}, "v": {"y0": 0.7, "z0": speed}}
    return bare(accuracy, start, FALLING | (changes or {}))


@pytest.mark.parametrize("accuracy", ["balanced", RK4], ids=["5e-6", "rk4"])
def test_free_fall(accuracy):
    """All bodies fall alike, whatever the joint angles."""
    sim, until, n = falling(1.0, 0.5, 0.3, accuracy=accuracy), 0.15, 19
    lin = sim.linearize(until=until, params=["ice.gravity"])
    assert not lin.events
    unit = np.eye(2 * n + 4)
    for c in (0, 1):
        close(lin.A[:, c], unit[c])
        close(lin.A[:, n + c], until * unit[c] + unit[n + c])
    close(lin.P[:, 0], -(until**2) / 2.0 * unit[1] - until * unit[n + 1])
    # The joints and the tilt keep their angles, and a change of them does not set them in motion;
    # residual 1.7e-12.
    close(lin.A[2:n, 2:n], np.eye(n - 2), 5e-12)
    close(lin.A[n + 2 : 2 * n, :n], np.zeros((n - 2, n)), 5e-12)


@pytest.mark.parametrize("gravity", [GRAVITY, 0.0])
@pytest.mark.parametrize("tilt", [0.3, -0.2], ids=["heel", "toe"])
def test_time_of_a_landing(tilt, gravity):
    """The time of a fall from h at v, by h, v, g and the tilt; without gravity it is h / |v|."""
    sim = falling(0.05, -0.4, tilt, {"ice.gravity": gravity})
    n, sole = len(sim.q), 0.28
    v = sim.v
    low = sim.gaps()[0].min() + CLOSED
    down = np.sqrt(v[1] ** 2 + 2.0 * gravity * low)
    landing = (down + v[1]) / gravity if gravity else low / -v[1]
    lin = sim.linearize(until=landing + 1e-4, params=["ice.gravity"])
    event = lin.events[0]
    close(event["time"], landing)
    close(event["guard_rate"], -down)
    dt = event["dt_dx"]
    close(dt[1], 1.0 / down)
    close(dt[n + 1], landing / down)
    close(dt[2], -sole * np.cos(tilt) / down if tilt > 0.0 else 0.0)
    # The foot that begins to turn is tilted by so much more at the landing.
    close(dt[n + 2], landing * dt[2])
    close(event["dt_dp"][0], -(landing**2) / (2.0 * down))
    close(np.delete(dt[: 2 * n], [1, 2, n + 1, n + 2]), np.zeros(2 * n - 4))


@pytest.mark.parametrize("mu", [0.2, 0.0, 5.0], ids=["slides", "without friction", "sticks"])
@pytest.mark.parametrize("tilt", [0.3, -0.2], ids=["heel", "toe"])
def test_saltation_matrix_of_a_landing(tilt, mu):
    """A plastic impact (Kong et al. 2023), from M, the Jacobian J of the contact and the gap g.

    v+ = v- - M^-1 D (J M^-1 D)^-1 J v-: D is J^T for a foot that sticks; a foot that slides has one
    row, and friction turns the force. The gap depends on q only, so D_v R is exact, and the
    positions change by (v+ - v-) D_q g / g'.
    """
    changes = {"ice.friction": {"kind": "coulomb", "mu": mu, "capture_speed": 0.0}}
    sim = falling(0.02, -0.4, tilt, changes, "reference")
    n = len(sim.q)
    lin = sim.linearize(until=0.05)
    event = lin.events[0]
    q, before, time = sim.q, sim.v, event["time"]
    q[:2] += time * before[:2] - [0.0, GRAVITY * time**2 / 2.0]
    before[1] -= GRAVITY * time
    # The end that lands turns with the foot about the toe.
    J = np.eye(2, n)
    if tilt > 0.0:
        sole = 0.28
        J[:, 2] = sole * np.sin(q[2]), -sole * np.cos(q[2])
    inverse = np.linalg.inv(sim.mass_matrix(q))
    moved = J @ before
    stuck = inverse @ J.T @ np.linalg.solve(J @ inverse @ J.T, J)
    impulse = -np.linalg.solve(J @ inverse @ J.T, moved)
    if abs(impulse[0]) > mu * impulse[1]:
        D = J[1] - mu * np.sign(moved[0]) * J[0]
        stuck = np.outer(inverse @ D, J[1]) / (J[1] @ inverse @ D)
    after = before - stuck @ before
    xi = event["saltation"][: 2 * n, : 2 * n]
    rate = J[1] @ before
    found_velocities, exact = xi[n:, n:], np.eye(n) - stuck
    found_positions, moved_by = xi[:n, :n], np.eye(n) - np.outer(after - before, J[1]) / -rate
    close(found_velocities, exact)
    close(xi[:n, n:], np.zeros((n, n)))
    close(found_positions, moved_by)
