"""Baselines: the paper's controller, complete or in part."""

import gymnasium
import numpy as np
import pytest

from skate_env import Simulator, load_scene
from skate_env.policies import baseline
from skate_env.scenes import replace
from skate_env.studies.fixtures import BLADE

# Without noise of the start, and with the scene's own duration of an action.
PLAIN = {"perturb": 0.0, "action_period": 0.01}
TAU8 = {"control.arm_swing": {"amplitude": 30.0}}


def end_of(policy, steps=60):
    env = gymnasium.make("IceSkate-v0", **PLAIN, scene=policy.scene)
    observation, _ = env.reset(seed=0)
    for _ in range(steps):
        action, _ = policy.predict(observation)
        observation, *_ = env.step(action)
    return env.unwrapped.simulator.q


def test_no_residual_is_the_replay():
    sim = Simulator("paper")
    for _ in range(60):
        sim.step()
    np.testing.assert_array_equal(end_of(baseline.no_residual("paper")), sim.q)


def test_a_factor_multiplies_every_printed_torque():
    scene = replace(load_scene("paper"), TAU8)
    halved = baseline.scaled_feedforward(scene, 0.5).scene.parameters()
    assert halved["control.feedforward.scale"][0] == 0.5
    assert halved["control.arm_swing.amplitude"][0] == 15.0
    assert baseline.scaled_feedforward(scene, 1.0).scene == scene


def test_lifting_only_is_a_scene_without_the_printed_torques():
    scene = replace(load_scene("paper"), TAU8)
    silent = replace(scene, {"control.feedforward": None, "control.arm_swing": None})
    sim = Simulator(silent)
    for _ in range(60):
        sim.step()
    # Adding zero torques. Measured: identical bits.
    np.testing.assert_allclose(end_of(baseline.lifting_only(scene)), sim.q, atol=1e-12)


def test_missing_effects_stay_missing():
    scene = replace(load_scene("paper"), {"control.feedforward": None})
    assert baseline.lifting_only(scene).scene == scene


def test_predictions_are_zeros_of_the_action_shape():
    policy = baseline.no_residual(replace(load_scene(BLADE), {"locked": []}))
    for shape in ((76,), (5, 76)):
        action, state = policy.predict(np.ones(shape, np.float32))
        assert action.shape == (*shape[:-1], 10) and action.dtype == np.float32
        assert not action.any() and state is None


def test_impossible_factors_are_refused():
    with pytest.raises(ValueError, match=r"control.feedforward.scale = 11.*\[-10, 10\]"):
        baseline.scaled_feedforward("paper", 11.0)
    with pytest.raises(ValueError, match="no scene 'nope'"):
        baseline.lifting_only("nope")
