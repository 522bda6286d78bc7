"""The native vector environment: Gymnasium's interface, independence of the environments."""

import copy
import itertools
import multiprocessing
import os
import pickle
import warnings

import gymnasium
import numpy as np
import pytest
from gymnasium.error import ClosedEnvironmentError, ResetNeeded
from gymnasium.utils.env_checker import data_equivalence
from gymnasium.vector import AutoresetMode, VectorEnv

from skate_env import load_scene
from skate_env.environments import IceSkateVectorEnv
from skate_env.scenes import replace

MODES = list(AutoresetMode)


def make(n=3, mode=AutoresetMode.NEXT_STEP, **keywords):
    arguments = {"scene": "push_only", "perturb": 0.01, "accuracy": "fast"} | keywords
    return IceSkateVectorEnv(n, autoreset_mode=mode, **arguments)


def actions_for(n, steps, seed=0):
    return np.random.default_rng(seed).uniform(-1, 1, (steps, n, 10)).astype(np.float32)


def over(result):
    return result[2] | result[3]


# --- Gymnasium's interface -----------------------------------------------------------------------


def test_make_vec_gives_no_warning():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        env = gymnasium.make_vec("IceSkate-v0", num_envs=5, scene="push_only")
    assert isinstance(env.unwrapped, IceSkateVectorEnv) and isinstance(env, VectorEnv)
    assert env.metadata["autoreset_mode"] is AutoresetMode.NEXT_STEP
    assert env.spec.max_episode_steps * env.unwrapped.action_period == pytest.approx(30.0)
    assert env.action_space.shape == (5, 10)
    assert env.observation_space.shape == (5, *env.single_observation_space.shape)
    single = gymnasium.make("IceSkate-v0", scene="push_only")
    assert env.single_action_space == single.action_space
    assert env.single_observation_space == single.observation_space


@pytest.mark.parametrize("mode", MODES)
def test_results_equal_those_of_gymnasiums_vector_environments(mode):
    """Observations, rewards, ends, infos, masks, final_obs and final_info, key by key."""
    n, steps = 3, 400
    keywords = {"scene": "push_only", "perturb": 0.01, "accuracy": "fast"}
    keywords |= {"action_period": 0.01, "action_scale": 100.0}
    own = gymnasium.make_vec(
        "IceSkate-v0", n, max_episode_steps=70, autoreset_mode=mode, **keywords
    )
    theirs = gymnasium.make_vec(
        "IceSkate-v0",
        n,
        vectorization_mode="sync",
        vector_kwargs={"autoreset_mode": mode},
        max_episode_steps=70,
        **keywords,
    )
    assert data_equivalence(own.reset(seed=7), theirs.reset(seed=7), exact=True)
    seen = {"terminated": 0, "truncated": 0}
    for actions in actions_for(n, steps):
        left, right = own.step(actions), theirs.step(actions)
        assert set(left[4]) == set(right[4])
        for mine, other in zip(left, right, strict=True):
            assert data_equivalence(mine, other, exact=True), (mine, other)
        seen["terminated"] += left[2].sum()
        seen["truncated"] += left[3].sum()
        if mode == AutoresetMode.DISABLED and over(left).any():
            options = {"reset_mask": over(left)}
            begun = own.reset(options=dict(options)), theirs.reset(options=dict(options))
            assert data_equivalence(*begun, exact=True)
    assert min(seen.values()) > 3


@pytest.mark.parametrize("mode", MODES)
def test_returned_arrays_are_copies(mode):
    env = make(mode=mode, max_episode_steps=5)
    given = [env.reset(seed=0)]
    for actions in actions_for(3, 5):
        observations, *rest = env.step(actions)
        given.append((observations, rest[-1]))
    arrays = [
        [observations, *(x for x in info.values() if isinstance(x, np.ndarray))]
        for observations, info in given
    ]
    for i, left in enumerate(arrays):
        for right in arrays[:i]:
            assert not any(np.shares_memory(a, b) for a in left for b in right)


def test_next_step_ignores_the_action_of_a_reset():
    ends = actions_for(3, 400)
    envs = [make(), make()]
    for env in envs:
        env.reset(seed=0)
    last = np.zeros(3, bool)
    resets = 0
    for actions in ends:
        other = np.where(last[:, None], -actions, actions)
        left, right = envs[0].step(actions), envs[1].step(other)
        assert data_equivalence(left, right, exact=True)
        assert (left[1][last] == 0.0).all() and not over(left)[last].any()
        resets += last.sum()
        last = over(left)
    assert resets > 3


# --- independence of the environments ------------------------------------------------------------


def test_a_masked_reset_changes_only_the_selected_environments():
    env, other = (make(mode=AutoresetMode.DISABLED) for _ in range(2))
    for each in (env, other):
        each.reset(seed=0)
        for actions in actions_for(3, 10):
            each.step(actions)
    mask = np.array([False, True, False])
    observations, info = env.reset(seed=[None, 50, None], options={"reset_mask": mask})
    np.testing.assert_array_equal(info["_time"], mask)
    before, after = other.snapshot(), env.snapshot()
    assert [a == b for a, b in zip(before, after, strict=True)] == (~mask).tolist()
    fresh, _ = make(1).reset(seed=50)
    np.testing.assert_array_equal(observations[1], fresh[0])


@pytest.mark.parametrize(
    ("wrong", "kind", "words"),
    [
        ({"seed": [1, 2]}, ValueError, ["2 seeds", "must be 3"]),
        ({"seed": -1}, ValueError, ["seed = -1", "must lie in"]),
        ({"seed": [0, 1, 1.5]}, TypeError, ["seed = 1.5", "must be an int"]),
        ({"seed": 2**64 - 2}, ValueError, ["seed = 18446744073709551616"]),
        ({"options": {"mask": 1}}, ValueError, ["option 'mask'", "state, params, phase"]),
        ({"options": {"reset_mask": [True] * 3}}, TypeError, ["reset_mask", "not list"]),
        ({"options": {"reset_mask": np.ones(3)}}, TypeError, ["reset_mask", "float64"]),
        ({"options": {"reset_mask": np.ones(2, bool)}}, ValueError, ["(2,)", "(3,)"]),
        ({"options": {"reset_mask": np.zeros(3, bool)}}, ValueError, ["at least one"]),
        ({"options": {"elapsed": np.zeros(2, int)}}, ValueError, ["elapsed", "(2,)", "(3,)"]),
        ({"options": {"elapsed": np.array([0, -1, 0])}}, ValueError, ["elapsed = -1"]),
        ({"options": {"elapsed": np.zeros(3)}}, TypeError, ["elapsed has dtype float64"]),
        ({"options": {"perturb": np.nan}}, ValueError, ["perturb = NaN", "[0, 10]"]),
        ({"options": {"phase": 1e9}}, ValueError, ["phase = 1000000000", "[0, 1000] steps"]),
        ({"options": {"phase": 50.0}}, ValueError, ["phase = 50", "makes only", "fall"]),
        ({"options": {"params": {"ice.mu": 1.0}}}, ValueError, ["ice.mu", "no number"]),
        ({"options": {"state": {"q": np.zeros(3)}}}, ValueError, ["q has shape (3,)"]),
    ],
)
def test_a_refused_reset_changes_nothing(refused, wrong, kind, words):
    env = make(mode=AutoresetMode.DISABLED)
    env.reset(seed=0)
    env.step(actions_for(3, 1)[0])
    before = env.snapshot()
    refused(kind, lambda: env.reset(**wrong), *words)
    assert env.snapshot() == before


@pytest.mark.parametrize(
    ("wrong", "kind", "words"),
    [
        (np.full((3, 10), np.nan), ValueError, ["actions[0, 0] = nan", "finite"]),
        (np.pad([[np.inf]], ((2, 0), (3, 6))), ValueError, ["actions[2, 3] = inf"]),
        (np.zeros((3, 9)), ValueError, ["(3, 9)", "(3, 10)"]),
        (np.zeros(10), ValueError, ["(10,)", "(3, 10)"]),
        (np.zeros((4, 10)), ValueError, ["(4, 10)", "(3, 10)"]),
        (np.zeros((3, 10), complex), TypeError, ["complex128", "real numbers"]),
        (np.zeros((3, 10), bool), TypeError, ["bool", "real numbers"]),
        ("abc", TypeError, ["real numbers"]),
        (None, TypeError, ["object", "real numbers"]),
        ([[0.0] * 10, [0.0], []], ValueError, ["not an array"]),
    ],
)
def test_wrong_actions_leave_every_environment_as_it_was(refused, wrong, kind, words):
    env = make()
    env.reset(seed=0)
    env.step(actions_for(3, 1)[0])
    before = env.snapshot()
    refused(kind, lambda: env.step(wrong), *words)
    assert env.snapshot() == before


def test_a_snapshot_from_before_the_reset_has_to_be_reset_again(refused):
    env = make()
    before = env.snapshot()
    env.reset(seed=0)
    env.step(actions_for(3, 1)[0])
    env.restore([*env.snapshot()[:2], before[2]])
    zero = np.zeros((3, 10), np.float32)
    refused(ResetNeeded, lambda: env.step(zero), "environment 2", "has not been reset")


def test_an_info_of_no_environment_is_refused(refused):
    env = make()
    env.reset(seed=0)
    refused(ValueError, lambda: env.info(3), "environment = 3", "0 to 2")
    refused(ValueError, lambda: env.info(-1), "environment = -1", "0 to 2")


def test_a_step_before_the_reset_and_after_the_end_is_refused(refused):
    env = make(mode=AutoresetMode.DISABLED)
    zero = np.zeros((3, 10), np.float32)
    refused(ResetNeeded, lambda: env.step(zero), "environment 0", "has not been reset")
    env.reset(seed=0, options={"reset_mask": np.array([True, False, True])})
    refused(ResetNeeded, lambda: env.step(zero), "environment 1", "has not been reset")
    env.reset(seed=0)
    while not over(result := env.step(zero)).any():
        pass
    before = env.snapshot()
    first = int(np.flatnonzero(over(result))[0])
    refused(ResetNeeded, lambda: env.step(zero), f"environment {first}", "is over")
    assert env.snapshot() == before


def test_a_closed_environment_raises(refused):
    env = make(render_mode="rgb_array")
    env.reset(seed=0)
    env.close()
    env.close()
    for call in (env.reset, env.render, lambda: env.step(np.zeros((3, 10)))):
        refused(ClosedEnvironmentError, call, "closed")


@pytest.mark.parametrize(
    ("wrong", "kind", "words"),
    [
        ({"num_envs": 0}, ValueError, ["num_envs = 0", "at least 1"]),
        ({"num_envs": 2.0}, TypeError, ["num_envs = 2.0", "int"]),
        ({"num_threads": 0}, ValueError, ["num_threads = 0", "at least 1"]),
        ({"max_episode_steps": -3}, ValueError, ["max_episode_steps = -3"]),
        ({"autoreset_mode": "sometimes"}, ValueError, ["sometimes", "NextStep"]),
        ({"render_mode": "human"}, ValueError, ["render_mode = 'human'", "rgb_array"]),
        ({"scene": "nope"}, ValueError, ["no scene 'nope'"]),
        ({"reward": {"head": "1"}}, TypeError, ["reward['head'] = '1'", "real number"]),
    ],
)
def test_wrong_keywords_are_named(refused, wrong, kind, words):
    refused(kind, lambda: IceSkateVectorEnv(**wrong), *words)


# --- time limits, seeds, copies ------------------------------------------------------------------


def test_elapsed_actions_stagger_the_time_limits():
    env = make(mode=AutoresetMode.SAME_STEP, scene="paper", max_episode_steps=30)
    env.reset(seed=0, options={"elapsed": np.array([0, 10, 20])})
    truncated = np.array([env.step(np.zeros((3, 10)))[3] for _ in range(60)])
    at = [np.flatnonzero(column).tolist() for column in truncated.T]
    assert at == [[29, 59], [19, 49], [9, 39]]


def test_minus_one_is_no_time_limit_as_for_one_environment():
    one = gymnasium.make("IceSkate-v0", max_episode_steps=-1)
    assert not isinstance(one, gymnasium.wrappers.TimeLimit)
    many = gymnasium.make_vec("IceSkate-v0", num_envs=2, max_episode_steps=-1)
    many.reset(seed=0, options={"elapsed": np.array([10**9, 0])})
    assert not many.step(np.zeros((2, 10), np.float32))[3].any()


def test_environments_without_a_seed_begin_differently():
    one, two = make(), make()
    starts = np.concatenate([one.reset()[0], two.reset()[0]])
    assert len(np.unique(starts, axis=0)) == 6
    # And continue with their own sequences.
    assert not np.array_equal(one.reset()[0], starts[:3])


@pytest.mark.parametrize("mode", MODES)
def test_copies_and_pickles_continue_equally(mode):
    env = make(mode=mode, max_episode_steps=40)
    env.reset(seed=3)
    allowed = mode != AutoresetMode.DISABLED
    for actions in actions_for(3, 100 if allowed else 20):
        env.step(actions)
    saved = env.snapshot()
    twins = [copy.deepcopy(env), pickle.loads(pickle.dumps(env)), make(mode=mode)]
    twins[2] = make(mode=mode, max_episode_steps=40)
    twins[2].restore(saved)
    for actions in actions_for(3, 100 if allowed else 10, seed=9):
        wanted = env.step(actions)
        for twin in twins:
            assert data_equivalence(twin.step(actions), wanted, exact=True)
    env.restore(saved)
    assert env.snapshot() == saved


def test_damaged_snapshots_change_nothing(refused):
    env = make()
    env.reset(seed=0)
    before = env.snapshot()
    broken = [before[0], before[1][:-1] + b"x", before[2]]
    refused(ValueError, lambda: env.restore(broken), "not a snapshot", "checksum")
    refused(ValueError, lambda: env.restore(before[:2]), "2 snapshots", "must be 3")
    other = IceSkateVectorEnv(1, replace(load_scene("push_only"), {"contact.impacts": False}))
    refused(ValueError, lambda: other.restore(before[:1]), "not a snapshot of this scene")
    assert env.snapshot() == before


def test_lanes_do_not_change_results():
    made = []
    most = make()._batch.lanes
    for lanes in sorted({1, most}):
        env = make(20)
        env._batch.lanes = lanes
        env.reset(seed=0)
        made.append([env.step(actions) for actions in actions_for(20, 30)])
        assert env._batch.lanes == lanes
    for steps in zip(*made, strict=True):
        for one_by_one, many in itertools.pairwise(steps):
            assert data_equivalence(one_by_one, many, exact=True)
    env = make()
    for lanes in (0, 3, 2 * most):
        with pytest.raises(ValueError, match=f"lanes = {lanes}: must be 1"):
            env._batch.lanes = lanes
    assert env._batch.lanes == most


@pytest.mark.skipif(not hasattr(os, "fork"), reason="this system does not fork")
@pytest.mark.filterwarnings("ignore:.*multi-threaded.*fork")
def test_a_forked_process_creates_its_own_threads():
    # The parent's threads do not survive the fork; a child that waited for them would hang.
    env = make(8, num_threads=2)
    env.reset(seed=0)
    actions = actions_for(8, 20)
    for each in actions[:10]:
        env.step(each)
    saved = env.snapshot()

    def child(pipe):
        for each in actions[10:]:
            observations, *_ = env.step(each)
        pipe.send(observations)

    context = multiprocessing.get_context("fork")
    ours, theirs = context.Pipe()
    process = context.Process(target=child, args=(theirs,))
    process.start()
    assert ours.poll(60), "the child hangs"
    seen = ours.recv()
    process.join()
    env.restore(saved)
    for each in actions[10:]:
        observations, *_ = env.step(each)
    np.testing.assert_array_equal(observations, seen)


def test_pictures_are_one_for_each():
    env = make(render_mode="rgb_array")
    env.reset(seed=0)
    frames = env.render()
    assert len(frames) == 3 and {frame.shape for frame in frames} == {(540, 960, 3)}
    # A copy has its own renderer, and every picture is a new array.
    for mine, its, again in zip(frames, copy.deepcopy(env).render(), env.render(), strict=True):
        np.testing.assert_array_equal(mine, its)
        np.testing.assert_array_equal(mine, again)
        assert not np.shares_memory(mine, again)
    assert make().render() is None
