"""Training: observations, rewards and starts of the learner; reproducibility."""

import dataclasses
import json

import numpy as np
import pytest
import torch
from typer.testing import CliRunner

from skate_env import load_scene
from skate_env.cli import app
from skate_env.cli.options import name_and_value
from skate_env.learning import checkpoint, ppo, training_env
from skate_env.learning.configs import CONFIGS, Hyperparameters
from skate_env.learning.export import digest, policy_of
from skate_env.learning.overrides import override
from skate_env.learning.ppo import begin, learn
from skate_env.learning.reward import Counts, Reward, Weights
from skate_env.policy import Policy
from skate_env.sb3 import IceSkateVecEnv
from training import curves

# Small for a test; all other values as in training.
SMALL = Hyperparameters(
    actions=8 * 32 * 6,
    envs=8,
    rollout=32,
    minibatch=64,
    epochs=2,
    warm_up=5,
    critic_first=512,
    fine_from=0.6,
)


@pytest.fixture(autouse=True)
def _one_thread():
    torch.set_num_threads(1)


def start(seed=1, numbers=SMALL):
    about = {"scene": "unilateral", "seed": seed, "hyperparameters": numbers}
    return begin(load_scene("unilateral"), seed, numbers), about


def trained(folder, seed=1):
    model, about = start(seed)
    learn(model, about, folder)
    return policy_of(model, {})


def test_the_first_policy_is_the_baseline():
    model, _ = start()
    shape = (50, *model.observation_space.shape)
    seen = np.random.default_rng(0).normal(size=shape).astype(np.float32)
    actions, _ = model.predict(seen, deterministic=True)
    np.testing.assert_array_equal(actions, 0.0)
    policy = policy_of(model, {})
    observation = np.random.default_rng(1).normal(size=len(policy.observation_names))
    np.testing.assert_array_equal(policy.predict(observation.astype(np.float32))[0], 0.0)


def test_one_seed_is_one_policy(tmp_path):
    one, again, other = (
        trained(tmp_path / name, seed) for name, seed in (("a", 1), ("b", 1), ("c", 2))
    )
    assert digest(one) == digest(again) != digest(other)


def test_a_policy_has_the_effects_of_its_training(tmp_path):
    few = ["actions=512", "envs=8", "rollout=32", "minibatch=64", "warm_up=1"]
    without = ["feedforward", "visual_lifting"]
    options = [*(f"--set={each}" for each in few), *(f"--without={each}" for each in without)]
    result = CliRunner().invoke(app, ["train", "--out", str(tmp_path), *options])
    assert result.exit_code == 0, result.stderr
    effects = Policy.load(tmp_path / ppo.POLICY).scene.effects()
    assert not effects["feedforward"] and not effects["visual_lifting"]
    assert effects["push_only"]


def test_a_config_is_taken_by_name_or_with_its_scene(tmp_path):
    few = [
        f"--set={each}"
        for each in ("actions=512", "envs=8", "rollout=32", "minibatch=64", "warm_up=1")
    ]
    for scene, config, taken in (
        ("unilateral", None, Hyperparameters()),
        ("unilateral", "contact_sequence", CONFIGS["contact_sequence"]),
        ("paper", None, CONFIGS["paper"]),
    ):
        chosen = ["--config", config] if config else []
        arguments = ["--scene", scene, "--out", str(tmp_path), *chosen, *few]
        assert CliRunner().invoke(app, ["train", *arguments]).exit_code == 0
        told = Policy.load(tmp_path / ppo.POLICY).about["hyperparameters"]
        assert told["leg_torque"] == taken.leg_torque and told["perturb"] == taken.perturb
        assert told["weights"] == json.loads(json.dumps(dataclasses.asdict(taken.weights)))


def test_an_unknown_config_is_refused(tmp_path):
    result = CliRunner().invoke(app, ["train", "--out", str(tmp_path), "--config", "magic"])
    assert result.exit_code == 2
    assert "'magic': must be one of paper, paper_damped, contact_sequence" in result.stderr


def test_curves_are_drawn_from_what_trainings_write(tmp_path):
    for seed in (1, 2):
        trained(tmp_path / str(seed), seed)
    folders = [tmp_path / "1", tmp_path / "2"]
    figure = curves.draw({"one": folders[:1], "both": folders})
    for ax, tag in zip(figure.axes, curves.PANELS, strict=True):
        lines = ax.get_lines()
        for line, shown in zip(lines, (folders[:1], folders), strict=True):
            last = 1e6 * line.get_xdata()[-1]
            values = [np.interp(last, *curves.curve(folder, tag)) for folder in shown]
            assert line.get_ydata()[-1] == pytest.approx(np.mean(values), abs=1e-9)
    (tmp_path / "empty").mkdir()
    with pytest.raises(ValueError, match="empty: holds no episode/lasted_s"):
        curves.draw({"nothing": [tmp_path / "empty"]})


def test_the_last_part_has_located_events(tmp_path, monkeypatch):
    model, about = start()
    seen, step = [], training_env.TrainingEnv.step_async

    def watch(course, actions):
        seen.append(json.loads(course.batch.simulator(0).scene.to_json())["accuracy"])
        step(course, actions)

    monkeypatch.setattr(training_env.TrainingEnv, "step_async", watch)
    learn(model, about, tmp_path)
    rough, fine = {"method": "moreau", "step": SMALL.step}, "balanced"
    # The fifth and the sixth rollout.
    assert seen == [rough] * 4 * SMALL.rollout + [fine] * 2 * SMALL.rollout


@pytest.mark.parametrize("part", [0.6, 0.95])
def test_a_resumed_training_is_the_same(tmp_path, monkeypatch, part):
    whole = trained(tmp_path / "whole")
    model, about = start()

    class Stopped(Exception):
        pass

    def stop(stages):
        if stages.num_timesteps > SMALL.actions * part:
            raise Stopped
        return True

    with monkeypatch.context() as patch:
        patch.setattr(ppo, "CHECKPOINT_PERIOD", 0.0)
        patch.setattr(ppo.StageCallback, "_on_step", stop)
        with pytest.raises(Stopped):
            learn(model, about, tmp_path)
    resumed, told = checkpoint.load(tmp_path / ppo.CHECKPOINT)
    assert told == about
    assert 0 < resumed.num_timesteps < SMALL.actions
    learn(resumed, told, tmp_path / "rest")
    assert digest(policy_of(resumed, {})) == digest(whole)


def test_a_resumed_training_keeps_the_scene_and_numbers_of_its_checkpoint(tmp_path):
    arguments = ["--out", str(tmp_path), "--resume", "--seed", "2", "--set", "actions=1"]
    result = CliRunner().invoke(app, ["train", *arguments])
    assert result.exit_code == 2
    assert "--seed, --set: --resume uses" in result.stderr


def test_the_exported_policy_acts_as_the_learner_does(tmp_path):
    model, about = start()
    learn(model, about, tmp_path)
    policy = policy_of(model, {"why": "a test"})
    assert policy.about["why"] == "a test" and "torch" in policy.about["versions"]
    # The exported scene has its original accuracy, not the coarse one of the training.
    assert policy.scene.to_toml() == load_scene("unilateral").to_toml()
    course = model.get_env().venv
    envs = course.batch
    observations, _ = envs.reset(seed=5)
    turned = 0
    for _ in range(150):
        left = observations[:, course.leg] < 0.0
        turned += left.sum()
        shown = np.where(left[:, None], course.mirror(observations), observations)
        normal = model.get_env().normalize_obs(shown)
        wanted = np.zeros((course.num_envs, len(envs.joint_names)), np.float32)
        wanted[:, course.joints] = model.predict(normal, deterministic=True)[0]
        wanted[left] = course.mirror_action(wanted[left])
        actions, _ = policy.predict(observations)
        np.testing.assert_allclose(actions, wanted, atol=1e-5)  # 2e-6
        observations, *_ = envs.step(actions)
    assert turned > 10


def test_the_training_environment_agrees_with_the_environment():
    numbers = dataclasses.replace(SMALL, mirrored=False)
    course = ppo.training_env_of(load_scene("unilateral"), numbers, 1)
    envs = IceSkateVecEnv(
        8,
        scene=course.batch.scene,
        action_scale=course.torques,
        perturb=numbers.perturb,
        trunk_noise=numbers.trunk_noise,
        kick=numbers.kick,
        max_episode_steps=numbers.episode,
        stagger=True,
    )
    for each in (course, envs):
        each.seed(3)
    np.testing.assert_array_equal(course.reset(), envs.reset())
    rng = np.random.default_rng(0)
    ended = 0
    for _ in range(400):
        action = rng.uniform(-0.3, 0.3, (8, *course.action_space.shape)).astype(np.float32)
        whole = np.zeros((8, 16), np.float32)
        whole[:, course.joints] = action
        seen, _, done, infos = course.step(action)
        wanted, _, wanted_done, wanted_infos = envs.step(whole)
        np.testing.assert_array_equal(seen, wanted)
        np.testing.assert_array_equal(done, wanted_done)
        for i in np.flatnonzero(done):
            ended += 1
            for key in ("terminal_observation", "TimeLimit.truncated"):
                np.testing.assert_array_equal(infos[i][key], wanted_infos[i][key])
    assert ended > 8


def test_a_mirrored_training_environment_is_the_mirror_image():
    plain = ppo.training_env_of(
        load_scene("unilateral"), dataclasses.replace(SMALL, mirrored=False), 1
    )
    mirrored = ppo.training_env_of(load_scene("unilateral"), SMALL, 1)
    for each in (plain, mirrored):
        each.seed(3)
    seen, shown = plain.reset(), mirrored.reset()
    rng = np.random.default_rng(0)
    turned = 0
    for _ in range(200):
        left = seen[:, plain.leg] < 0.0
        turned += left.sum()
        np.testing.assert_array_equal(shown[left], plain.mirror(seen[left]))
        np.testing.assert_array_equal(shown[~left], seen[~left])
        action = rng.uniform(-0.3, 0.3, (8, *plain.action_space.shape)).astype(np.float32)
        whole = np.zeros((8, 16), np.float32)
        whole[:, plain.joints] = action
        whole[left] = plain.mirror_action(whole[left])
        seen, rewards, *_ = plain.step(action)
        shown, same_rewards, *_ = mirrored.step(whole[:, plain.joints])
        np.testing.assert_array_equal(rewards, same_rewards)
    assert turned > 100


def columns(**values):
    whole = {name: np.full(1, values.get(name, 0)) for name in ("steps", "state_number")}
    names = ("time", "flight_time", "double_support_time", "reward_slide", "y_position")
    return whole | {name: np.full(1, values.get(name, 0.0)) for name in names}


def paid(counts, info, weights=None, ended=False):
    heights = ["height.free_heel", "height.free_toe"]
    names = ["angle.q8", "head_error.x", "slip.support", *heights]
    reward = Reward(weights or Weights(), names)
    seen, actions = np.zeros((1, len(names)), np.float32), np.zeros((1, 2), np.float32)
    terms = reward.terms(0.0, counts, info, seen, actions, np.array([ended]))
    return {name: value.item() for name, value in terms.items()}


def test_running_is_not_rewarded():
    standing = paid(Counts(columns()), columns(time=0.01))
    flying = paid(Counts(columns()), columns(time=0.01, flight_time=0.01))
    assert sum(flying.values()) < sum(standing.values())


@pytest.mark.parametrize("feet", [1, 2])
def test_standing_is_not_rewarded(feet):
    counts = Counts(columns(time=1.0))
    slid = {"reward_slide": 0.015, "y_position": 0.02, "double_support_time": 0.01 * (feet - 1)}
    after = columns(time=1.01, state_number={1: 3, 2: 15}[feet], **slid)
    assert paid(counts, after)["slide"] > 0.0
    counts = Counts(columns(time=1.0))
    counts.swap_time[:] = -0.5
    parked = paid(counts, after)
    assert parked["slide"] == parked["alive"] == parked["double"] == 0.0


def steps_paid(*steps):
    """Rewards of steps with these periods [s], slides and distances [m], one after the other."""
    counts, time, y, earned = Counts(columns()), 0.0, 0.0, []
    for made, (period, slide, *way) in enumerate(steps, start=1):
        time += period
        y += way[0] if way else slide
        info = columns(time=time, reward_slide=slide, steps=made, state_number=3, y_position=y)
        earned.append(paid(counts, info)["step"])
    return earned


def test_limping_and_chattering_are_not_rewarded():
    good, tap, rattle = (0.5, 0.4), (0.15, 0.0), (0.12, 0.4)
    first, second = steps_paid(good, good)
    assert first == 0.0 < second
    assert sum(steps_paid(good, tap, good, tap)) == 0.0
    assert sum(steps_paid(rattle, rattle, rattle)) == 0.0
    # Feet that slide forward while the robot moves backward.
    assert sum(steps_paid((0.5, 0.4, -0.2), (0.5, 0.4, -0.2))) == 0.0
    shorter = steps_paid(good, (0.5, 0.2), good)
    assert shorter[1] == shorter[2] == pytest.approx(0.5 * second)


def test_excess_speed_is_penalised():
    weights = Weights(fastest=(1.0,), hurry=(3.0,))
    slow, fast = (
        paid(Counts(columns()), columns(time=0.1, y_position=way), weights) for way in (0.1, 0.3)
    )
    assert slow["hurry"] == 0.0 and fast["hurry"] == pytest.approx(-0.6)


def test_a_step_in_the_papers_order_is_rewarded():
    weights = Weights(order=(10.0,), dwell=(100.0,), shortest_step=(0.1,))
    counts, earned = Counts(columns()), []
    for i, state in enumerate((3, 7, 15, 16, 14, 3), start=1):
        slid = {"reward_slide": 0.04, "y_position": 0.04 * i}
        info = columns(time=0.1 * i, state_number=state, steps=i // 6, **slid)
        earned.append(paid(counts, info, weights))
    # Each state is rewarded when it is reached, and all of them again at the swap.
    assert sum(terms["order"] for terms in earned[:-1]) == pytest.approx(10.0)
    assert earned[-1]["order"] == pytest.approx(10.0)
    assert earned[-1]["dwell"] == 0.0 < earned[-2]["dwell"]
    assert counts.order.reached == 0


def test_slide_on_a_sole_edge_is_rewarded_less():
    weights = Weights(edge=(0.25,))
    slid = {"time": 0.1, "reward_slide": 0.1, "y_position": 0.1}
    flat = paid(Counts(columns()), columns(**slid, state_number=3), weights)
    edge = paid(Counts(columns()), columns(**slid, state_number=4), weights)
    assert edge["slide"] == pytest.approx(0.25 * flat["slide"])


def test_stages_follow_each_other_evenly():
    weights = Weights(flight=(1.0, 8.0), shortest_step=(0.2, 0.4, 0.5), fall=(3.0,))
    assert weights.at(0.0)["flight"] == 1.0 and weights.at(1.0)["flight"] == 8.0
    assert weights.at(0.25)["shortest_step"] == pytest.approx(0.3)
    assert weights.at(0.75)["shortest_step"] == pytest.approx(0.45)
    assert weights.at(0.3)["fall"] == 3.0


@pytest.mark.parametrize(
    "change",
    [
        "nonsense=1",
        "rate",
        "rate=fast",
        "rate=[1]",
        "envs=1.5",
        "envs=true",
        "noise=[]",
        'noise=[0.1, "x"]',
        "layers=[64.5]",
        "weights.nonsense=1",
        "weights=1",
    ],
)
def test_unknown_hyperparameters_are_refused(change):
    with pytest.raises(ValueError, match=change.partition("=")[0]):
        override(Hyperparameters(), [name_and_value(change, "rate=1e-3")])


def test_hyperparameters_are_changed_by_name():
    assert override(Hyperparameters(), []) == Hyperparameters()
    numbers = override(
        Hyperparameters(),
        [("rate", 1), ("weights.flight", [1, 4]), ("weights.alive", 2), ("mirrored", False)],
    )
    assert numbers.rate == 1 and numbers.mirrored is False
    assert numbers.weights.flight == (1, 4) and numbers.weights.alive == (2,)
