"""Left and right: mirrored states and actions give the mirrored motion, bit for bit.

Bits are compared because impacts and event times amplify rounding errors: a tolerance such as 1e-12
would be exceeded soon.
"""

from functools import partial

import numpy as np
import pytest

import skate_env
from skate_env import load_scene
from skate_env.environments import PAPER_ACTIONS, IceSkateEnv
from skate_env.scenes import Mirror, replace

METHODS = [
    "balanced",
    "fast",
    {"method": "rk4", "step": 1e-3},
    {"method": "rosenbrock", "tolerance": 1e-5},
]
OTHER = {"right": "left", "left": "right"}
# All joints act, with the torques that the paper prints, and nothing is mirrored.
whole = partial(IceSkateEnv, **PAPER_ACTIONS)


def both(scene, **keywords):
    envs = whole(scene, **keywords), whole(scene, **keywords)
    coordinates = envs[0].simulator.coordinate_names
    return envs, Mirror(coordinates), Mirror(envs[0].joint_names)


def begin_mirrored(envs, mirror, q, v, leg):
    envs[0].reset(seed=0, options={"state": {"q": q, "v": v, "support_leg": leg}})
    state = {"q": mirror(q), "v": mirror(v), "support_leg": OTHER[leg]}
    envs[1].reset(seed=0, options={"state": state})


@pytest.mark.parametrize("accuracy", METHODS)
@pytest.mark.parametrize("name", skate_env.scene_names())
def test_one_action_from_states_of_the_gait_and_near_it(name, accuracy):
    scene = replace(load_scene(name), {"control.arm_swing": {"amplitude": 30.0}})
    envs, mirror, mirror_action = both(scene, accuracy=accuracy)
    see = Mirror(envs[0].observation_names)
    rng = np.random.default_rng(0)
    walk = whole(scene)
    walk.reset()
    checked = 0
    for _ in range(60):
        for _ in range(4):
            if walk.step(np.zeros(16))[2]:
                walk.reset()
        sim = walk.simulator
        q, v = sim.q, sim.v
        trunk = [i for i, x in enumerate(sim.coordinate_names) if int(x[1:]) in range(8, 18)]
        q[trunk] += rng.normal(0.0, 0.2, len(trunk))
        v[trunk] += rng.normal(0.0, 1.0, len(trunk))
        try:
            begin_mirrored(envs, mirror, q, v, sim.support_leg)
        except ValueError:
            continue  # Not a valid start: a contact state of the gait only.
        action = rng.uniform(-1.0, 1.0, 16).astype(np.float32)
        left = envs[0].step(action)
        right = envs[1].step(mirror_action(action))
        sims = [env.simulator for env in envs]
        for of in ("q", "v", "torque", "acceleration"):
            np.testing.assert_array_equal(mirror(getattr(sims[0], of)), getattr(sims[1], of))
        np.testing.assert_array_equal(see(left[0]), right[0])
        assert left[1:4] == right[1:4]
        legs = [info.pop("support_leg") for info in (left[4], right[4])]
        assert legs[0] == OTHER[legs[1]] and left[4] == right[4]
        checked += 1
    assert checked > 15


def test_a_second_of_skating_is_mirrored_too():
    scene = replace(load_scene("paper"), {"control.arm_swing": {"amplitude": 30.0}})
    envs, mirror, mirror_action = both(scene)
    sim = envs[0].simulator
    begin_mirrored(envs, mirror, sim.q, sim.v, sim.support_leg)
    rng = np.random.default_rng(1)
    for _ in range(100):
        action = rng.uniform(-0.1, 0.1, 16).astype(np.float32)
        envs[0].step(action)
        envs[1].step(mirror_action(action))
    q = [env.simulator.q for env in envs]
    np.testing.assert_array_equal(mirror(q[0]), q[1])


@pytest.mark.parametrize("kind", ["coordinates", "joints", "observation"])
def test_mirrored_twice_is_as_before(kind):
    env = whole("paper")
    names = {
        "coordinates": env.simulator.coordinate_names,
        "joints": env.joint_names,
        "observation": env.observation_names,
    }[kind]
    mirror = Mirror(names)
    values = np.random.default_rng(0).normal(size=(5, len(names))).astype(np.float32)
    mirrored = mirror(values)
    assert mirrored.dtype == np.float32 and not np.array_equal(mirrored, values)
    np.testing.assert_array_equal(mirror(mirrored), values)
