"""The mirrored view and the joints of an action: options of the environments."""

import gymnasium
import numpy as np
import pytest

import skate_env
from skate_env import IceSkateEnv, load_scene
from skate_env.environments import TORQUE_SCALE, IceSkateVectorEnv
from skate_env.environments.config import SKATING
from skate_env.scenes import Mirror, replace

SETTINGS = {"perturb": 0.02, "trunk_noise": 0.01, "kick": 0.6, "max_episode_steps": 150}
COMPARED = ("time", "loaded_slide", "flight_time", "y_position", "support_leg", "termination")


@pytest.mark.parametrize("joints", ["all", ["q8", "q2", "q11", "q17", "q10"]])
@pytest.mark.parametrize("mode", ["SameStep", "NextStep"])
def test_the_mirrored_view_is_the_mirror_image(joints, mode):
    n = 8
    plain, mirrored = (
        IceSkateVectorEnv(
            n, "push_only", joints=each, mirrored=on, autoreset_mode=mode, accuracy="fast",
            action_scale=100.0, **SETTINGS,
        )
        for each, on in (("all", False), (joints, True))
    )  # fmt: skip
    see, act = Mirror(plain.observation_names), Mirror(plain.joint_names)
    chosen = [plain.joint_names.index(joint) for joint in mirrored.joint_names]
    leg = plain.observation_names.index("support_leg")

    def mirror_left(seen):
        return np.where(seen[:, leg, None] < 0.0, see(seen), seen)

    seen, _ = plain.reset(seed=3)
    shown, _ = mirrored.reset(seed=3)
    rng, turned, ended = np.random.default_rng(0), 0, 0
    for _ in range(300):
        left = seen[:, leg] < 0.0
        turned += left.sum()
        np.testing.assert_array_equal(shown, mirror_left(seen))
        action = rng.uniform(-0.5, 0.5, (n, len(chosen))).astype(np.float32)
        full = np.zeros((n, 16), np.float32)
        full[:, chosen] = action
        full[left] = act(full[left])
        seen, _, *ends, infos = plain.step(full)
        shown, _, *same_ends, same_infos = mirrored.step(action)
        np.testing.assert_array_equal(ends, same_ends)
        for key in (*COMPARED, *(key for key in infos if key.startswith("reward_"))):
            np.testing.assert_array_equal(infos[key], same_infos[key])
        for i in np.flatnonzero(infos.get("_final_obs", np.zeros(n, bool))):
            wanted = mirror_left(infos["final_obs"][i][None])[0]
            np.testing.assert_array_equal(same_infos["final_obs"][i], wanted)
        ended += np.sum(ends)
    # Measured: at least 437 and 18.
    assert turned > 100 and ended > 5


def test_a_mirrored_environment_always_shows_right_support():
    env = IceSkateEnv("paper_printed")
    env.reset(seed=0)
    leg, legs = env.observation_names.index("support_leg"), set()
    for _ in range(300):
        observation, *_, info = env.step(np.zeros(10))
        assert observation[leg] == 1.0
        legs.add(info["support_leg"])
    assert legs == {"left", "right"}


def test_an_action_moves_the_chosen_joints_in_their_order():
    joints = ["q17", "q3", "q14"]
    env = IceSkateEnv("paper_printed", joints=joints, action_scale={"q3": 30.0})
    assert env.joint_names == joints and env.action_space.shape == (3,)
    rest = {joint: TORQUE_SCALE[joint] for joint in ("q17", "q14")}
    assert env.action_scale == rest | {"q3": 30.0}
    env.reset(seed=0)
    sim = skate_env.Simulator("paper_printed")
    env.step(np.float32([0.5, -0.25, 1.0]))
    torque = {"q17": 0.5 * rest["q17"], "q3": -7.5, "q14": rest["q14"]}
    sim.step(list((dict.fromkeys(TORQUE_SCALE, 0.0) | torque).values()))
    np.testing.assert_array_equal(env.simulator.q, sim.q)


def test_default_joints_are_those_that_the_scene_does_not_lock(paper):
    env = IceSkateEnv(paper(locked=["q10", "q17"]))
    assert env.joint_names == [joint for joint in SKATING if joint not in ("q10", "q17")]
    assert IceSkateEnv(paper(locked=["q10"]), joints="all").action_space.shape == (15,)


def test_a_scene_with_one_arm_has_no_mirrored_view(paper, refused):
    scene = paper(locked=["q11"])
    refused(ValueError, lambda: IceSkateEnv(scene), "mirrored = true", "q14", "without q11")
    assert IceSkateEnv(scene, mirrored=False).joint_names == list(SKATING)


def test_single_and_vector_agree_on_every_id():
    for name in ("IceSkate-v0", "IceSkatePushOnly-v0", "IceSkateAnyIce-v0"):
        single, many = gymnasium.make(name), gymnasium.make_vec(name, num_envs=2)
        seen, _ = many.reset(seed=5)
        first, _ = single.reset(seed=5)
        np.testing.assert_array_equal(seen[0], first)
        single.action_space.seed(0)
        for _ in range(50):
            action = single.action_space.sample()
            one, reward, over, _, _ = single.step(action)
            several, rewards, ends, _, _ = many.step(np.stack([action, action]))
            np.testing.assert_array_equal(several[0], one)
            assert (rewards[0], ends[0]) == (reward, over)
            if over:
                break


def test_any_ice_draws_friction_masses_and_lengths():
    env, drawn = gymnasium.make("IceSkateAnyIce-v0").unwrapped, []
    for seed in range(20):
        env.reset(seed=seed)
        drawn.append({name: x for name, (x, *_) in env.simulator.scene.parameters().items()})
    own = {name: x for name, (x, *_) in load_scene("push_only").parameters().items()}
    differ = {name for name in own if len({each[name] for each in drawn}) == 20}
    masses = {name for name in own if name.startswith("body.") and name.endswith("mass")}
    lengths = {name for name in own if name.startswith("body.") and name.endswith("length")}
    assert differ == {"ice.friction.mu_forward"} | masses | lengths and masses and lengths
    for each in drawn:
        assert 0.05 <= each["ice.friction.mu_forward"] <= 0.4
        assert all(0.75 <= each[name] / own[name] <= 1.25 for name in masses)
        assert all(0.95 <= each[name] / own[name] <= 1.05 for name in lengths)
    kept = replace(load_scene("paper_printed"), {"randomise": {"ice.gravity": [9.0, 10.0]}})
    scene = gymnasium.make("IceSkateAnyIce-v0", scene=kept).unwrapped.scene
    assert '"ice.gravity"' in scene.to_toml() and '"body.foot.mass"' in scene.to_toml()
