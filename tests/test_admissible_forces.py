"""What ice can exert: tau1 needs a flat sole; only the paper's contact captures a slow foot."""

import json
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

import training
from skate_env import Policy, Simulator, load_scene
from skate_env.replay import record
from skate_env.scenes import replace
from skate_env.studies.fixtures import BLADE

ORDER = Path(training.__file__).parent / "imitation" / "policies" / "push_only_order.npz"
# States in which tau1 acts: the supporting foot is on its toe, the free foot is flat.
PUSH_OFF = (14, 16, 18, 20)
CAPTURED = "supporting foot slows down"


def push_only(**fields):
    return replace(load_scene("push_only"), fields)


def q1(sim):
    return sim.coordinate_names.index("q1")


def test_tau1_is_the_couple_of_equation_16_times_its_scale():
    torques = {}
    for scale in (0.0, 0.5, 1.0):
        sim = Simulator(replace(load_scene("paper"), {"control.feedforward.tau1_scale": scale}))
        while sim.state_number not in PUSH_OFF:
            assert sim.advance(sim.time + 1e-3)
        sim.advance(sim.time + 2e-3)  # the controller has sampled the state
        assert sim.state_number in PUSH_OFF
        torques[scale] = sim.torque[q1(sim)]
    assert torques[0.0] == 0.0
    assert torques[0.5] == 0.5 * torques[1.0]
    # cos(pi (t - t2)) is 1 to 1e-3 within 14 ms.
    assert torques[1.0] == pytest.approx(-100.0, rel=1e-3)


@pytest.mark.parametrize("name", [BLADE, "push_only"])
def test_presets_whose_ice_only_pushes_have_admissible_forces_and_no_couple(name):
    sim = Simulator(load_scene(name))
    assert sim.scene.effects()["push_only"]
    while len(sim.take_steps()) == 0 or sim.time < 3.0:
        assert sim.step()
        assert sim.torque[q1(sim)] == 0.0
    recording = record(Simulator(load_scene(name)), 6)
    np.testing.assert_array_equal(recording.steps["inadmissible_time"], 0.0)


def test_a_foot_on_its_toe_cannot_carry_tau1():
    policy = Policy.load(ORDER)
    inadmissible, pushing_off = {}, {}
    for scale in (0.0, 0.1):
        scene = replace(policy.scene, {"control.feedforward.tau1_scale": scale})
        recording = record(Simulator(scene), 1, policy=policy.on(scene))
        inadmissible[scale] = recording.steps["inadmissible_time"].sum()
        end = recording.steps["time"][-1]
        visits = pairwise([event for event in recording.events.tolist() if event[0] <= end])
        pushing_off[scale] = sum(b[0] - a[0] for a, b in visits if a[3] in PUSH_OFF)
    assert inadmissible[0.0] == 0.0
    assert pushing_off[0.1] > 0.2
    # The controller notices a state at its next sample: measured 3.8 ms, in 9 visits.
    assert inadmissible[0.1] == pytest.approx(pushing_off[0.1], abs=8e-3)


def test_the_impulse_of_a_capture_is_rarely_one_that_ice_exerts():
    """Why push-only ice captures no foot: it stops a flat sole at once, the other foot in the air.

    The impulse of the root is S v, with the articulated inertia S = ((M^-1) of the root)^-1
    (Featherstone 2008, section 7.1).
    """
    sim = Simulator(push_only())
    fields = json.loads(sim.scene.to_json())
    sole = fields["body"]["foot"]["toe"] + fields["body"]["foot"]["heel"]
    friction = fields["ice"]["friction"]
    rng = np.random.default_rng(1)
    admissible = []
    for _ in range(2000):
        q = sim.q
        q[3:] += 0.6 * rng.normal(size=q.size - 3)
        S = np.linalg.inv(np.linalg.inv(sim.mass_matrix(q))[:3, :3])
        for direction in (-1.0, 1.0):
            along, normal, couple = -direction * S[:, 0]
            heel = -couple / sole
            low, high = -friction["mu_forward"] * normal, friction["mu_backward"] * normal
            admissible.append(heel >= 0.0 and normal >= heel and low <= along <= high)
    # Measured 0.027.
    assert 0.0 < np.mean(admissible) < 0.03


@pytest.mark.parametrize("law", ["push_only", "two_way"])
def test_only_two_way_contact_captures_a_slow_foot(law):
    sim = Simulator(push_only(**{"contact.law": law}))
    v = np.zeros(sim.v.size)
    v[0] = 0.01
    sim.reset(sim.q, v)
    assert (CAPTURED in sim.guards(sim.time, sim.q, sim.v)) == (law == "two_way")


def test_a_sliding_foot_on_push_only_ice_stops_without_an_impulse():
    """Friction brings it to rest: its velocity has no jump, also below the capture speed."""
    scene = load_scene("push_only").without("lifting").without("feedforward")
    sim = Simulator(replace(scene, {"fall": None}))
    v = np.zeros(sim.v.size)
    v[0] = 0.05
    sim.reset(sim.q, v)
    before = sim.v[0]
    stuck = False
    while not stuck and sim.time < 0.2:
        assert sim.advance(sim.time + 1e-5)
        stuck = sim.state_number in (1, 2, 5, 6, 9, 10, 13, 14, 17, 18)
        jump = abs(sim.v[0] - before)
        before = sim.v[0]
        # 1e-5 s at the deceleration of some 20 m/s2.
        assert jump < 1e-3
    assert stuck
