"""Policies: actions of a perceptron, mirror symmetry, and use in an environment."""

import dataclasses
import json
import pickle

import gymnasium
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from skate_env import IceSkateEnv, Mirror, Policy, Simulator, load_scene
from skate_env.policies import loading, shipped
from skate_env.scenes import replace
from skate_env.studies.fixtures import BLADE

PRESETS = ["paper_printed", "push_only"]


def observations(scene, n=120, size=0.3):
    """Observations of random actions (n, d) with both supporting legs."""
    env = IceSkateEnv(scene, joints="all", mirrored=False)
    rng = np.random.default_rng(1)
    rows = [env.reset(seed=0)[0]]
    while len(rows) < n:
        observation, _, over, *_ = env.step(rng.uniform(-size, size, env.action_space.shape))
        rows.append(observation)
        if over:
            env.reset(options={"phase": 1.5})
    seen = np.array(rows)
    legs = seen[:, env.observation_names.index("support_leg")]
    assert set(legs.tolist()) == {1.0, -1.0}
    return seen


@pytest.mark.parametrize("name", PRESETS)
def test_actions_are_those_of_the_network(name, random_policy):
    learned = random_policy(name, size=1.0)
    see, act = Mirror(learned.observation_names), Mirror(learned.joint_names)
    leg = learned.observation_names.index("support_leg")
    clipped = 0
    for seen in observations(name):
        left = seen[leg] < 0
        x = np.clip(((see(seen) if left else seen) - learned.mean) / learned.std, -10.0, 10.0)
        for weight, bias in learned.layers[:-1]:
            x = np.tanh([row @ x + b for row, b in zip(weight, bias, strict=True)])
        weight, bias = learned.layers[-1]
        wanted = np.clip(weight @ x + bias, -1.0, 1.0)
        clipped += np.any(np.abs(wanted) == 1.0)
        action, _ = learned.predict(seen)
        assert action.dtype == np.float32 and action.shape == (16,)
        # Single precision against double. Measured: 2.6e-7.
        np.testing.assert_allclose(action, act(wanted) if left else wanted, atol=2e-6)
    assert clipped


def test_each_action_depends_on_its_own_observation_only(random_policy):
    learned = random_policy()
    seen = observations("paper_printed")
    together, state = learned.predict(seen, state="as it is")
    assert together.shape == (len(seen), 16) and state == "as it is"
    alone = np.array([learned.predict(row)[0] for row in seen])
    np.testing.assert_array_equal(together, alone)
    np.testing.assert_array_equal(learned.predict(seen[7:10])[0], alone[7:10])


@pytest.mark.parametrize("name", PRESETS)
def test_left_and_right_are_exact(name, random_policy):
    learned = random_policy(name)
    see, act = Mirror(learned.observation_names), Mirror(learned.joint_names)
    seen = observations(name)
    actions, _ = learned.predict(seen)
    np.testing.assert_array_equal(learned.predict(see(seen))[0], act(actions))
    for row, action in zip(seen, actions, strict=True):
        np.testing.assert_array_equal(learned.predict(see(row))[0], act(action))


def test_it_skates_mirrored_from_a_mirrored_start(random_policy):
    learned = random_policy()
    envs = [gymnasium.make("IceSkate-v0", perturb=0.0, **learned.environment()) for _ in range(2)]
    start = Simulator("paper_printed")
    mirror = Mirror(start.coordinate_names)
    states = (
        {"q": start.q, "v": start.v, "support_leg": "right"},
        {"q": mirror(start.q), "v": mirror(start.v), "support_leg": "left"},
    )
    seen = [
        env.reset(seed=0, options={"state": state})[0]
        for env, state in zip(envs, states, strict=True)
    ]
    for _ in range(150):
        seen = [env.step(learned.predict(each)[0])[0] for env, each in zip(envs, seen, strict=True)]
    right, left = (env.unwrapped.simulator for env in envs)
    np.testing.assert_array_equal(mirror(right.q), left.q)
    assert right.time == left.time > 1.0 and not np.array_equal(right.q, start.q)


def test_its_residual_agrees_with_the_environment(random_policy):
    learned = random_policy("push_only", size=1.0)
    env = gymnasium.make("IceSkate-v0", perturb=0.0, **learned.environment())
    assert env.unwrapped.scene == learned.scene
    seen, _ = env.reset(seed=0)
    sim, over = Simulator("push_only"), False
    while not over:
        seen, _, over, *_ = env.step(learned.predict(seen)[0])
        assert sim.step(learned.residual(sim)) != over
    np.testing.assert_array_equal(sim.q, env.unwrapped.simulator.q)


def test_its_environment_is_json_and_draws_numbers_only_if_asked(random_policy):
    ranges = {"ice.friction.mu_forward": [0.1, 0.3]}
    learned = random_policy(replace(load_scene("push_only"), {"randomise": ranges}))
    for asked in (False, True):
        given = learned.environment(randomise=asked)
        env = gymnasium.make("IceSkate-v0", **json.loads(json.dumps(given)))
        assert env.unwrapped.scene.get("randomise") == (ranges if asked else {})
        without = replace(env.unwrapped.scene, {"randomise": ranges})
        assert without == learned.scene
        again = gymnasium.make(gymnasium.envs.registration.EnvSpec.from_json(env.spec.to_json()))
        assert again.unwrapped.scene == env.unwrapped.scene


def test_without_weights_it_is_the_baseline(random_policy):
    silent = random_policy(size=0.0)
    sim, alone = Simulator("paper_printed"), Simulator("paper_printed")
    for _ in range(100):
        sim.step(silent.residual(sim))
        alone.step()
    assert sim.snapshot() == alone.snapshot()


def test_noise_is_optional_and_depends_on_the_seed(random_policy, tmp_path):
    learned = random_policy(size=0.0)
    # Equal for both arms, as they are exchanged by mirroring.
    log_std = np.linspace(-4.0, -1.5, 16)
    log_std[12:15] = log_std[9:12]
    learned = dataclasses.replace(learned, log_std=log_std)
    learned.save(tmp_path / "p.npz")
    seen = np.tile(observations("paper_printed"), (50, 1))

    def noise(seed):
        return Policy.load(tmp_path / "p.npz", seed=seed).predict(seen, deterministic=False)[0]

    np.testing.assert_array_equal(noise(0), noise(0))
    assert not np.array_equal(noise(0), noise(1))
    assert not learned.predict(seen)[0].any()
    # 6000 draws: the standard error of the standard deviation is 0.9 %, of the mean 1.3 % of it.
    # Measured: at most 1.8 % and 3.6 %.
    np.testing.assert_allclose(noise(0).std(axis=0), np.exp(learned.log_std), rtol=0.04)
    assert np.all(np.abs(noise(0).mean(axis=0)) < 0.05 * np.exp(learned.log_std))
    assert np.abs(noise(0)).max() <= 1.0


def test_saved_and_loaded_is_the_same(random_policy, tmp_path):
    scene = replace(load_scene(BLADE), {"accuracy": 1e-7, "ice.friction.mu_forward": 1 / 3})
    learned = random_policy(scene)
    # The file name gets no suffix.
    path = tmp_path / "policy"
    learned.save(path)
    assert [file.name for file in tmp_path.iterdir()] == ["policy"]
    loaded = Policy.load(path)
    assert loaded.scene == scene and loaded.environment() == learned.environment()
    for field in dataclasses.fields(Policy):
        mine, other = getattr(learned, field.name), getattr(loaded, field.name)
        if field.name == "layers":
            for pair, twin in zip(mine, other, strict=True):
                for part, same in zip(pair, twin, strict=True):
                    assert part.dtype == same.dtype == np.float32
                    np.testing.assert_array_equal(part, same)
        elif isinstance(mine, np.ndarray):
            assert mine.dtype == other.dtype
            np.testing.assert_array_equal(mine, other)
        else:
            assert mine == other, field.name
    seen = observations(scene)
    for twin in (loaded, pickle.loads(pickle.dumps(learned)), learned.on(scene)):
        np.testing.assert_array_equal(twin.predict(seen)[0], learned.predict(seen)[0])
    json.dumps(loaded.about)


WRONG = {
    "layers": [
        ([], "one or more pairs"),
        ([(np.zeros((16, 76)),)], "pairs of weight and bias"),
        ([(np.zeros((16, 75)), np.zeros(16))], "weight0 has shape (16, 75): must be (16, 76)"),
        ([(np.zeros((15, 76)), np.zeros(15))], "weight0 has shape (15, 76): must be (16, 76)"),
        ([(np.full((16, 76), np.nan), np.zeros(16))], "weight0[0, 0] = nan: must be finite"),
        ([(np.zeros((16, 76)), np.full(16, 2e6))], "bias0[0] = 2000000.0: must lie in"),
    ],
    "log_std": [(np.zeros(15), "log_std has shape (15,)"), (np.full(16, 6.0), "[-20, 5]")],
    "mean": [(np.full(76, np.inf), "mean[0] = inf"), (np.zeros((76, 1)), "mean has shape")],
    "std": [(np.zeros(76), "std[0] = 0.0: must lie in [1e-06, 1e+06]")],
    "clip": [(0.0, "clip = 0.0"), (float("nan"), "clip = nan"), ("much", "clip = ")],
    "action_scale": [
        ({"q2": 1.0}, "action_scale: 'q3' is missing"),
        ({"q99": 1.0}, "unknown joint in action_scale 'q99'"),
        (5.0, "action_scale = 5.0: must be a dict"),
        (dict.fromkeys([f"q{i}" for i in range(2, 18)], -1.0), "action_scale[q2] = -1"),
    ],
    "observation_names": [
        (["height"], "observation_names[0] is 'height': in environments of the scene 'paper'"),
        ("angle.q2", "must be a list of names"),
    ],
    "joint_names": [(["q2"], "joint_names[1] is None: in environments of the scene 'paper'")],
    "about": [({"x": np.zeros(2)}, "about: not for JSON"), ([], "about = []: must be a dict")],
    "seed": [(-1, "seed = -1"), (0.5, "seed = 0.5")],
}


@pytest.mark.parametrize(
    ("field", "value", "said"), [(f, *case) for f, cases in WRONG.items() for case in cases]
)
def test_mismatching_arrays_are_refused_by_name(field, value, said, random_policy):
    with pytest.raises((TypeError, ValueError)) as refusal:
        dataclasses.replace(random_policy(), **{field: value})
    assert said in str(refusal.value)


def test_a_policy_owns_its_arrays(random_policy):
    mean = np.zeros(76)
    learned = dataclasses.replace(random_policy(), mean=mean)
    mean[:] = 1.0
    assert not learned.mean.any()


def test_a_scene_with_other_joints_is_refused(random_policy):
    learned = random_policy()
    assert learned.on(load_scene(BLADE)).scene == load_scene(BLADE)
    with pytest.raises(ValueError, match=r"joint_names\[9\] is 'q11'.*it is 'q17'"):
        learned.on(load_scene("paper_printed").without("arms"))


def test_invalid_observations_are_refused(random_policy, refused):
    learned = random_policy()
    refused(ValueError, lambda: learned.predict(np.zeros(75)), "(75,)", "(76,)")
    refused(ValueError, lambda: learned.predict(np.full(76, np.nan)), "observation[0] = nan")
    refused(ValueError, lambda: learned.predict(0.0), "observation has shape ()")
    refused(TypeError, lambda: learned.predict(np.zeros(76, bool)), "observation", "bool")


@settings(max_examples=40, deadline=None)
@given(
    st.lists(st.sampled_from([1e6, -1e6, 1.0, 0.0, 1e-6]), min_size=3, max_size=3),
    st.sampled_from([1e-6, 1.0, 1e6]),
    st.booleans(),
)
def test_accepted_observations_give_actions(random_policy, sizes, std, deterministic):
    layers = [
        (np.full((o, i), size), np.full(o, size))
        for size, (i, o) in zip(sizes, ((76, 512), (512, 512), (512, 16)), strict=True)
    ]
    extreme = dataclasses.replace(
        random_policy(), layers=layers, std=np.full(76, std), clip=1e6, log_std=np.full(16, 5.0)
    )
    action, _ = extreme.predict(np.ones((2, 76)), deterministic=deterministic)
    assert np.all(np.abs(action) <= 1.0)


def test_shipped_policies_are_found_by_their_scene(random_policy, tmp_path, monkeypatch):
    monkeypatch.setattr(loading, "_FOLDER", tmp_path)
    for name in ("paper_arms", "paper_printed"):
        random_policy(name).save(tmp_path / f"{name}.npz")
    assert Policy.load(shipped("paper_printed")).scene == load_scene("paper_printed")
    for name in ("push_only", "../paper", ""):
        with pytest.raises(ValueError, match=r"there is one for paper_arms, paper_printed$"):
            shipped(name)
