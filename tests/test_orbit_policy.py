"""The feedback about an orbit: a policy beside the learned ones."""

import copy
import dataclasses

import numpy as np
import pytest

from skate_env import Simulator, load_scene
from skate_env.environments import TORQUE_SCALE
from skate_env.learning import evaluation
from skate_env.learning.rollouts import Conditions
from skate_env.policies import OrbitPolicy, Policy, load, shipped
from skate_env.scenes import Mirror
from skate_env.scenes import replace as changed
from skate_env.studies.fixtures import PAPER_DAMPED
from tests.commands import invoke
from training.orbits import close, feedback, measure

pytestmark = pytest.mark.long("designs a feedback")


@pytest.fixture(scope="module")
def orbit():
    return close.find(changed(load_scene("paper_arms"), {"accuracy": "reference"}))


@pytest.fixture(scope="module")
def policy(orbit):
    return feedback.design(orbit, TORQUE_SCALE)


@pytest.fixture(scope="module")
def observations(orbit):
    """Observations of a motion near the orbit, in both supports (n, d)."""
    sim = Simulator(orbit.strobe.scene)
    sim.perturb(0.02, 0)
    seen = []
    while sim.time < 1.5:
        sim.step()
        seen.append(sim.observation())
    return np.array(seen)


def test_a_file_holds_the_policy(policy, observations, tmp_path):
    policy.save(tmp_path / "orbit.npz")
    read = load(tmp_path / "orbit.npz")
    assert isinstance(read, OrbitPolicy)
    assert (read.predict(observations)[0] == policy.predict(observations)[0]).all()
    assert read.about == policy.about


def test_a_learned_policy_is_loaded_as_such():
    assert isinstance(load(shipped("push_only")), Policy)


def test_a_damaged_file_is_refused(tmp_path):
    path = tmp_path / "orbit.npz"
    path.write_bytes(b"nothing")
    with pytest.raises(ValueError, match=r"damaged|archive"):
        load(path)


def test_on_the_orbit_the_action_is_zero(orbit, policy):
    """Largest action below 1e-4: observations are in single precision."""
    sim = orbit.strobe.sim
    sim.restore(orbit.start.snapshot)
    first = orbit.start.tick + orbit.start.samples
    sizes = []
    for phase in range(0, orbit.start.samples, 2):
        sim.advance((first + phase) * orbit.start.period)
        sizes.append(np.abs(policy.predict(sim.observation())[0]).max())
    assert max(sizes) < 1e-4


def test_the_policy_is_mirror_symmetric(policy, observations):
    mirror, of_joints = Mirror(policy.observation_names), Mirror(policy.joint_names)
    actions, _ = policy.predict(observations)
    mirrored, _ = policy.predict(mirror(observations))
    assert np.abs(actions).max() > 1e-3
    assert (mirrored == of_joints(actions)).all()


def test_one_observation_has_the_action_of_many(policy, observations):
    """To rounding: matrix products depend on the number of rows."""
    actions, _ = policy.predict(observations)
    single = np.array([policy.predict(one)[0] for one in observations])
    assert np.abs(actions - single).max() < 1e-4


def test_joints_that_the_scene_locks_have_no_torque():
    scene = changed(load_scene(PAPER_DAMPED).without("arms"), {"accuracy": "reference"})
    made = feedback.design(close.find(scene), TORQUE_SCALE)
    assert len(made.joint_names) == 10
    assert list(made.action_scale) == list(made.joint_names)


def test_a_limit_shortens_deviations(policy, observations):
    near = dataclasses.replace(policy, limit=1e-4)
    small, large = (np.abs(one.predict(observations)[0]).max(axis=1) for one in (near, policy))
    assert (small <= large + 1e-6).all() and small.max() < 0.1 * large.max()


def test_parts_must_match(policy):
    fields = {name: getattr(policy, name) for name in policy.__dataclass_fields__}
    with pytest.raises(ValueError, match="limit"):
        OrbitPolicy(**{**fields, "limit": 0.0})
    with pytest.raises(ValueError, match="gains"):
        OrbitPolicy(**{**fields, "gains": fields["gains"][:-1]})
    with pytest.raises(ValueError, match=r"roots\[\d+, \d+, \d+\] = .*: must lie in"):
        OrbitPolicy(**{**fields, "roots": 1e30 * fields["roots"]})
    with pytest.raises(ValueError, match="actions"):
        OrbitPolicy(**{**fields, "actions": fields["actions"][:, 1:]})
    with pytest.raises(ValueError, match="references: must have at least one row"):
        OrbitPolicy(**{**fields, "references": fields["references"][:0]})


def test_the_closed_loop_contracts_faster(orbit, policy):
    """After five steps a deviation of 0.01 is below half of that without feedback."""
    left = {}
    for name, controller in (("alone", None), ("feedback", policy)):
        sim = copy.copy(orbit.strobe.sim)
        sim.restore(orbit.start.snapshot)
        noise = np.random.default_rng(1).normal(0.0, 0.01, len(sim.state_vector()))
        noise[0] = 0.0
        noise[2 * orbit.strobe.n :] = 0.0
        sim.displace(noise)
        for action in range(5 * orbit.start.samples // 10):
            torque = np.zeros(len(policy.joint_names))
            if controller is not None:
                scale = np.array(list(controller.action_scale.values()))
                torque = scale * controller.predict(sim.observation())[0]
            until = (orbit.start.tick + 10 * (action + 1)) * orbit.start.period
            sim.advance(until, torque)
        orbit.strobe.sim.restore(sim.snapshot())
        end = orbit.strobe.back(5) @ orbit.strobe.state
        left[name] = np.abs(end - orbit.strobe.at(orbit.start))[: 2 * orbit.strobe.n].max()
    assert left["feedback"] < 0.5 * left["alone"]


def test_evaluation_takes_it_like_a_learned_policy(policy, tmp_path):
    """It has no noise, so there is one contender only."""
    policy.save(tmp_path / "orbit.npz")
    found = evaluation.controllers("paper_arms", {"orbit": [tmp_path / "orbit.npz"]})
    assert [each.name for each in found] == ["baseline", "lifting only", "orbit"]
    conditions = Conditions(episodes=2, steps=2, disturbances={"perturb": 0.02})
    assert (evaluation.measure(found[-1], conditions)["completed"] == 1.0).all()


def test_the_command_writes_it(orbit, policy, observations, monkeypatch, tmp_path):
    monkeypatch.setattr(close, "find", lambda scene: orbit)
    monkeypatch.setattr(measure, "DIRECTIONS", 1)
    path = tmp_path / "orbit.npz"
    result = invoke("orbit", "--scene", "paper_arms", "--feedback", path)
    assert result.exit_code == 0, result.output
    assert (load(path).predict(observations)[0] == policy.predict(observations)[0]).all()
