"""Readings of the paper that are parameters of a scene: psi of Eq. 14, t_2 of Eqs. 16 and 17."""

import numpy as np
import pytest

from skate_env import IceSkateEnv, Simulator, load_scene
from skate_env.gait import ORDER, skate
from skate_env.scenes import replace

# Rows of the lower leg in `Simulator.link_segments`, which begins at the ankle, and of the head.
LOWER_LEG, HEAD = 1, 16


def psi_of(sim, psi, q):
    """Place of the point psi relative to the supporting ankle, and that of the ankle."""
    segments = sim.link_segments(q)
    neck, top = segments[HEAD]
    ankle = segments[LOWER_LEG, 0]
    return neck + psi * (top - neck) - ankle, ankle


@pytest.mark.parametrize("psi", [0.0, 0.5, 1.0])
def test_lifting_is_the_gradient_of_a_spring_at_psi(psi):
    """Eq. 15 by central differences; measured 2e-6 N m."""
    scene = load_scene("paper_printed")
    fields = {"control.psi": psi, "control.feedforward": None, "control.arm_swing": None}
    sim = Simulator(replace(scene, fields))
    sim.perturb(0.1, seed=3)
    lifting = scene.get("control.lifting")
    stiffness = np.array(lifting["K_p"])
    relative, ankle = psi_of(sim, psi, sim.q)
    target = np.array([0.0, lifting["ahead"], lifting["height"] - ankle[2]])
    wanted = np.zeros(sim.q.size)
    for name in ("q2", "q3", "q4", "q9", "q17"):
        step = 1e-6 * (np.array(sim.coordinate_names) == name)
        there, back = (psi_of(sim, psi, sim.q + side * step)[0] for side in (1.0, -1.0))
        slope = (there - back) / 2e-6
        wanted += (stiffness * (target - relative) @ slope) * (step > 0.0)
    np.testing.assert_allclose(sim.torque, wanted, atol=2e-5)


@pytest.mark.parametrize(("t2", "begins"), [("rotation", (14, 16)), ("flat", (14, 15, 16))])
def test_push_off_counts_from_t2(t2, begins):
    """Eq. 17, tau2 = -75 cos(pi (t - t_2)) in states 14 and 16.

    It is sampled up to 1 ms late, 75 pi 1 ms = 0.24 N m; the other reading is off by 1.7 N m.
    """
    scene = replace(load_scene("paper"), {"control.feedforward.t2": t2})
    entry = IceSkateEnv(scene).observation_names.index("feedforward.tau2")
    motion = skate(Simulator(scene), 4)
    events = motion.recording.events.tolist()
    entered = [t for t, _, before, after, _ in events if after in begins and before not in begins]
    assert motion.orders[0].in_order(False) and 15 in ORDER
    sim, seen = Simulator(scene), []
    for t in motion.recording.t:
        sim.advance(t)
        # In units of 205 N m; single precision.
        seen.append(205.0 * sim.observation()[entry])
    shown = motion.shown & np.isin(motion.recording.state_number, (14, 16))
    tau2, t = np.array(seen)[shown], motion.recording.t[shown]
    since = t - np.array(entered)[np.searchsorted(entered, t, side="right") - 1]
    assert shown.sum() > 100 and since.min() >= 0.0
    error = np.abs(tau2 + 75.0 * np.cos(np.pi * since))
    assert error.max() < 0.3
