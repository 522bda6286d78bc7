"""A simulator's observation equals that of its environment, bit for bit."""

import numpy as np
import pytest

import skate_env
from skate_env import IceSkateEnv, Simulator, load_scene
from skate_env.scenes import replace

SCENES = {
    **{name: load_scene(name) for name in skate_env.scene_names()},
    "fast": replace(load_scene("push_only"), {"accuracy": "fast"}),
    "no arms": load_scene("paper").without("arms"),
    # The head's target is the standing height, which depends on the geometry only.
    "no lifting": replace(load_scene("paper"), {"control.lifting": None}),
}


@pytest.mark.parametrize("name", SCENES)
def test_a_simulator_shows_what_its_environment_does(name):
    env, sim = IceSkateEnv(SCENES[name], joints="all", mirrored=False), Simulator(SCENES[name])
    scale = np.array(env._arguments["action_scale"])
    rng = np.random.default_rng(0)
    observation, _ = env.reset(seed=0)
    over, count = False, 0
    while not over and count < 200:
        np.testing.assert_array_equal(sim.observation(), observation)
        action = rng.uniform(-0.3, 0.3, len(scale)).astype(np.float32)
        observation, _, over, *_ = env.step(action)
        sim.step(scale * action)
        count += 1
    assert count > 20
    # After termination as well.
    np.testing.assert_array_equal(sim.observation(), observation)
    assert sim.observation().dtype == np.float32
    assert env.observation_space.contains(sim.observation())


def test_the_observation_uses_the_parameters_of_the_episode():
    scene = replace(load_scene("paper"), {"control.lifting": None})
    env, sim = IceSkateEnv(scene), Simulator(scene)
    params = {"body.lower_leg.length": 0.45, "body.upper_leg.length": 0.42}
    observation, _ = env.reset(seed=0, options={"params": params})
    np.testing.assert_array_equal(env.simulator.observation(), observation)
    sim.reset(params=params)
    np.testing.assert_array_equal(sim.observation(), observation)
    assert not np.array_equal(Simulator(scene).observation(), observation)
    # The observation does not change the state.
    before = sim.snapshot()
    sim.observation()
    assert sim.snapshot() == before
