"""Training: observations, rewards and starts of the learner; reproducibility."""

import json
from dataclasses import replace

import numpy as np
import pytest
import torch
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator
from typer.testing import CliRunner

from skate_env import Mirror, load_scene
from skate_env.cli import app
from skate_env.cli.options import name_and_value
from skate_env.environments import IceSkateVectorEnv
from skate_env.learning import checkpoint, ppo
from skate_env.learning.average import Average
from skate_env.learning.configs import CONFIGS, Hyperparameters
from skate_env.learning.export import digest, policy_of
from skate_env.learning.overrides import override
from skate_env.learning.ppo import Training, begin, learn
from skate_env.policies import Policy
from skate_env.sb3 import IceSkateVecEnv
from skate_env.studies.fixtures import BLADE
from training.benchmark.any_ice import mean_of
from training.benchmark.several import SeveralTraining

# Small for a test; all other values as in training.
SMALL = Hyperparameters(
    actions=8 * 32 * 6,
    envs=8,
    rollout=32,
    minibatch=64,
    epochs=2,
    fine_from=0.6,
    average_from=0.3,
)


@pytest.fixture(autouse=True)
def _one_thread():
    torch.set_num_threads(1)


def start(seed=1, numbers=SMALL, scenes=("push_only",)):
    scene, *others = map(load_scene, scenes)
    arguments = scene, seed, numbers, 1, {"scene": "push_only"}
    training = SeveralTraining(*arguments, tuple(others)) if others else Training(*arguments)
    return begin(training), training


def trained(folder, seed=1, scenes=("push_only",)):
    model, training = start(seed, scenes=scenes)
    average = Average()
    learn(model, training, average, folder)
    average.apply(model)
    return policy_of(model, training.scene, {})


def test_one_seed_is_one_policy(tmp_path):
    one, again, other = (
        trained(tmp_path / name, seed) for name, seed in (("a", 1), ("b", 1), ("c", 2))
    )
    assert digest(one) == digest(again) != digest(other)


def test_a_policy_has_the_effects_of_its_training(tmp_path):
    few = ["actions=512", "envs=8", "rollout=32", "minibatch=64"]
    without = ["feedforward", "lifting"]
    options = [*(f"--set={each}" for each in few), *(f"--without={each}" for each in without)]
    result = CliRunner().invoke(app, ["train", "--out", str(tmp_path), *options])
    assert result.exit_code == 0, result.stderr
    effects = Policy.load(tmp_path / ppo.POLICY).scene.effects()
    assert not effects["feedforward"] and not effects["lifting"]
    assert effects["push_only"]


def test_a_config_is_taken_with_its_scene(tmp_path):
    few = [f"--set={each}" for each in ("actions=512", "envs=8", "rollout=32", "minibatch=64")]
    for scene, taken in (("push_only", Hyperparameters()), ("paper", CONFIGS["paper"])):
        arguments = ["--scene", scene, "--out", str(tmp_path), *few]
        assert CliRunner().invoke(app, ["train", *arguments]).exit_code == 0
        told = Policy.load(tmp_path / ppo.POLICY).about["hyperparameters"]
        assert told["noise"] == taken.noise and told["perturb"] == taken.perturb


def test_a_training_writes_curves_for_tensorboard(tmp_path):
    trained(tmp_path)
    events = EventAccumulator(str(tmp_path)).Reload()
    shown = ("lasted_s", "period_s", "loaded_slide_per_step_m", "flight_share")
    for tag in (f"episode/{name}" for name in shown):
        points = events.Scalars(tag)
        assert points and all(np.isfinite(point.value) for point in points)
        assert 0 < points[-1].step <= SMALL.actions


def test_the_last_part_has_located_events_and_costs_flight_more(tmp_path, monkeypatch):
    model, training = start()
    seen, step = [], IceSkateVecEnv.step_async

    def watch(envs, actions):
        accuracy = json.loads(envs.batch.simulator(0).scene.to_json())["accuracy"]
        seen.append((accuracy, envs.batch._arguments["reward"]))
        step(envs, actions)

    monkeypatch.setattr(IceSkateVecEnv, "step_async", watch)
    learn(model, training, Average(), tmp_path)
    speed = {"high_speed": SMALL.high_speed}
    rough = {"method": "moreau", "step": SMALL.step}, speed
    fine = "balanced", speed | {"flight": SMALL.fine_flight}
    # The fifth and the sixth rollout.
    assert seen == [rough] * 4 * SMALL.rollout + [fine] * 2 * SMALL.rollout


@pytest.mark.parametrize(
    ("part", "scenes"),
    [(0.6, ["push_only"]), (0.95, ["push_only"]), (0.95, ["push_only", BLADE])],
)
def test_a_resumed_training_is_the_same(tmp_path, monkeypatch, part, scenes):
    whole = trained(tmp_path / "whole", scenes=scenes)
    model, training = start(scenes=scenes)

    class Stopped(Exception):
        pass

    def stop(callback):
        if callback.num_timesteps > SMALL.actions * part:
            raise Stopped
        return True

    with monkeypatch.context() as patch:
        patch.setattr(ppo, "CHECKPOINT_PERIOD", 0.0)
        patch.setattr(ppo.TrainingCallback, "_on_step", stop)
        with pytest.raises(Stopped):
            learn(model, training, Average(), tmp_path)
    resumed, (told, average) = checkpoint.load(tmp_path / ppo.CHECKPOINT)
    assert told == training
    assert 0 < resumed.num_timesteps < SMALL.actions
    learn(resumed, told, average, tmp_path / "rest")
    average.apply(resumed)
    assert digest(policy_of(resumed, told.scene, {})) == digest(whole)


def test_several_scenes_share_the_environments(tmp_path):
    """The joined environments are those of each scene, bit for bit, with consecutive seeds."""
    numbers = replace(SMALL, envs=7)
    _, training = start(numbers=numbers, scenes=("push_only", BLADE, "push_only"))
    joined = training.environments("balanced", 40)
    assert [part.num_envs for part in joined.parts] == [2, 2, 3]
    alone = [
        IceSkateVecEnv(
            count,
            stagger=True,
            max_episode_steps=40,
            scene=scene,
            accuracy="balanced",
            perturb=numbers.perturb,
            trunk_noise=numbers.trunk_noise,
            kick=numbers.kick,
        )
        for count, scene in zip((2, 2, 3), (training.scene, *training.others), strict=True)
    ]
    joined.seed(5)
    for envs, seed in zip(alone, (5, 7, 9), strict=True):
        envs.seed(seed)
    np.testing.assert_array_equal(joined.reset(), np.concatenate([e.reset() for e in alone]))
    rng, ended = np.random.default_rng(0), 0
    for _ in range(60):
        actions = rng.uniform(-1.0, 1.0, (7, *joined.action_space.shape)).astype(np.float32)
        found = joined.step(actions)
        parts = np.split(actions, [2, 4])
        wanted = list(zip(*(e.step(a) for e, a in zip(alone, parts, strict=True)), strict=True))
        for here, there in zip(found[:3], wanted[:3], strict=True):
            np.testing.assert_array_equal(here, np.concatenate(there))
        ended += found[2].sum()
        assert len(found[3]) == 7 and all(("time" in info) for info in joined.reset_infos)
    assert ended > 7
    joined.close()


def test_scenes_with_other_joints_are_refused():
    scene = load_scene("push_only")
    training = SeveralTraining(scene, 1, SMALL, 1, {}, (scene.without("arms"),))
    with pytest.raises(ValueError, match="observation_names differ"):
        training.environments("balanced", 40)


def test_a_training_begins_with_a_policy(tmp_path):
    """While the critic learns alone the actor is that of the policy; afterwards it learns."""
    first = trained(tmp_path / "first")
    first.save(tmp_path / "first.npz")
    few = ("actions=512", "envs=8", "rollout=32", "minibatch=64", "noise=0.1")
    for updates in (1, 2):
        overrides = [name_and_value(text, "") for text in (*few, f"critic_updates={updates}")]
        policy = ppo.train(
            tmp_path / "next", "push_only", 1, overrides, [], 1, tmp_path / "first.npz"
        )
        kept = [
            np.array_equal(a, b)
            for layer, other in zip(policy.layers, first.layers, strict=True)
            for a, b in zip(layer, other, strict=True)
        ]
        # There are two updates.
        assert all(kept) if updates == 2 else not any(kept)
        np.testing.assert_allclose(policy.mean, first.mean, atol=1e-3)
        assert np.exp(policy.log_std[:7]) == pytest.approx(0.1, rel=0.05)
        assert policy.about["begun_with"] == digest(first)


def test_the_mean_of_the_weights():
    model, _ = start()
    average, given = Average(), []
    average.apply(model)
    for seed in range(3):
        torch.manual_seed(seed)
        for parameter in model.policy.parameters():
            torch.nn.init.normal_(parameter)
        given.append({name: x.clone() for name, x in model.policy.state_dict().items()})
        average.add(model)
    average.apply(model)
    for name, mean in model.policy.state_dict().items():
        torch.testing.assert_close(mean, sum(each[name] for each in given) / 3)


def with_moments(policy, mean, std):
    """Return the same function of the observations with another normalisation."""
    (weight, bias), *rest = policy.layers
    bias = bias + weight @ ((mean - policy.mean) / policy.std)
    first = (weight * (std / policy.std)).astype(np.float32), bias.astype(np.float32)
    return replace(policy, layers=[first, *rest], mean=mean, std=std)


def test_the_mean_of_policies(tmp_path):
    one, other = trained(tmp_path / "a"), trained(tmp_path / "b", seed=2)
    both = mean_of([one, other])
    for layer, *given in zip(both.layers[1:], one.layers[1:], other.layers[1:], strict=True):
        for array, a, b in zip(layer, *given, strict=True):
            np.testing.assert_allclose(array, (a + b) / 2, rtol=1e-6)
    assert both.about["mean_of"] == [digest(one), digest(other)]
    # One of them counts twice. Measured: 6e-8 of a weight.
    twice = mean_of([one, other], [2, 1])
    for (weight, _), (same, _) in zip(twice.layers, mean_of([one, one, other]).layers, strict=True):
        np.testing.assert_allclose(weight, same, rtol=1e-6, atol=1e-7)
    # Normalisation does not matter. Measured: 1.8e-8.
    rng = np.random.default_rng(0)
    noise = other.std * rng.normal(0, 0.5, (51, len(other.mean)))
    shifted = with_moments(other, other.mean + noise[50], other.std * 1.3)
    seen = np.float32(other.mean + noise[:50])
    seen[:, list(one.observation_names).index("support_leg")] = 1.0
    for same in (mean_of([other, shifted]), mean_of([shifted, shifted]), mean_of([other])):
        np.testing.assert_allclose(same.predict(seen)[0], other.predict(seen)[0], atol=1e-7)


def test_a_mean_of_policies_of_different_kinds_is_refused(tmp_path):
    one = trained(tmp_path / "a")
    half = replace(one, action_scale={joint: x / 2 for joint, x in one.action_scale.items()})
    narrow = replace(one, layers=[one.layers[0], one.layers[2]])
    for policies, message in (
        ([], "at least one policy"),
        ([one, half], "action_scale differ"),
        ([one, narrow], "layers differ"),
    ):
        with pytest.raises(ValueError, match=message):
            mean_of(policies)
    for counts in ([1, 1], [0], []):
        with pytest.raises(ValueError, match="one number >= 1 for each"):
            mean_of([one], counts)


def test_a_policy_of_another_kind_is_refused(tmp_path):
    trained(tmp_path / "first").save(tmp_path / "first.npz")
    for changes, message in (
        ({"layers": [32]}, "--set layers=.64, 64."),
        ({"without": ["arms"]}, "other observations"),
    ):
        overrides = [(name, x) for name, x in changes.items() if name == "layers"]
        without = changes.get("without", [])
        with pytest.raises(ValueError, match=message):
            ppo.train(tmp_path / "b", "push_only", 1, overrides, without, 1, tmp_path / "first.npz")


def test_a_resumed_training_keeps_the_scene_and_numbers_of_its_checkpoint(tmp_path):
    arguments = ["--out", str(tmp_path), "--resume", "--seed", "2", "--set", "actions=1"]
    result = CliRunner().invoke(app, ["train", *arguments])
    assert result.exit_code == 2
    assert "--seed, --set: --resume uses" in result.stderr


def test_the_exported_policy_acts_as_the_learner_does(tmp_path):
    model, training = start()
    learn(model, training, Average(), tmp_path)
    policy = policy_of(model, training.scene, {"why": "a test"})
    assert policy.about["why"] == "a test" and "torch" in policy.about["versions"]
    # The exported scene has its original accuracy, not the coarse one of the training.
    assert policy.scene.to_toml() == load_scene("push_only").to_toml()
    # The learner sees the mirrored view, the policy mirrors by itself.
    shared = {"scene": training.scene, "perturb": 0.02, "autoreset_mode": "SameStep"}
    own = IceSkateVectorEnv(8, **shared)
    others = IceSkateVectorEnv(8, **(shared | policy.environment()))
    shown, _ = own.reset(seed=5)
    seen, _ = others.reset(seed=5)
    turned = 0
    for _ in range(150):
        wanted = model.predict(model.get_env().normalize_obs(shown), deterministic=True)[0]
        actions, _ = policy.predict(seen)
        left = seen[:, others.observation_names.index("support_leg")] < 0.0
        turned += left.sum()
        actions[left] = Mirror(others.joint_names)(actions[left])
        chosen = [others.joint_names.index(joint) for joint in own.joint_names]
        np.testing.assert_allclose(actions[:, chosen], wanted, atol=1e-5)  # 2e-6
        assert not np.delete(actions, chosen, axis=1).any()
        shown, *_ = own.step(wanted)
        actions = np.zeros_like(actions)
        actions[:, chosen] = np.clip(wanted, -1.0, 1.0)
        actions[left] = Mirror(others.joint_names)(actions[left])
        seen, *_ = others.step(actions)
    assert turned > 10


@pytest.mark.parametrize(
    "change",
    [
        "nonsense=1",
        "rate",
        "rate=fast",
        "rate=[1]",
        "envs=1.5",
        "envs=true",
        "noise=[0.1]",
        "layers=[]",
        'layers=[64, "x"]',
        "layers=[64.5]",
    ],
)
def test_unknown_hyperparameters_are_refused(change):
    with pytest.raises(ValueError, match=change.partition("=")[0]):
        override(Hyperparameters(), [name_and_value(change, "rate=1e-3")])


def test_a_checkpoint_has_the_ranges_of_a_new_training(tmp_path):
    model, training = start(numbers=replace(SMALL))
    # As in the file of a version without ranges.
    object.__setattr__(training.numbers, "gamma", 2.5)
    checkpoint.save(model, tmp_path / ppo.CHECKPOINT, (training, Average()))
    before = sorted(tmp_path.iterdir())
    with pytest.raises(ValueError, match=r"checkpoint.*gamma = 2.5: must lie in \[0, 1\]"):
        ppo.resume(tmp_path)
    assert sorted(tmp_path.iterdir()) == before


def test_hyperparameters_are_changed_by_name():
    assert override(Hyperparameters(), []) == Hyperparameters()
    numbers = override(Hyperparameters(), [("rate", 1), ("layers", 32)])
    assert (numbers.rate, numbers.layers) == (1, (32,))
