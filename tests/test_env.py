"""The single environment: actions, observations, episodes."""

import warnings
from functools import partial

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import skate_env
from skate_env.environments import PAPER_ACTIONS, TORQUE_SCALE, IceSkateEnv
from skate_env.environments.config import SKATING
from skate_env.scenes import replace

PRESETS = skate_env.scene_names()
ZERO = np.zeros(16, np.float32)
# All joints act, with the torques that the paper prints, and nothing is mirrored.
whole = partial(IceSkateEnv, **PAPER_ACTIONS)
SCALE = PAPER_ACTIONS["action_scale"]


@pytest.mark.parametrize("name", PRESETS)
@pytest.mark.parametrize("perturb", [0.0, 0.01])
def test_gymnasiums_checker_passes(name, perturb):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        env = gymnasium.make("skate_env:IceSkate-v0", scene=name, perturb=perturb)
        check_env(env.unwrapped)


# --- actions -------------------------------------------------------------------------------------


@pytest.mark.parametrize("accuracy", ["balanced", "fast"])
@pytest.mark.parametrize("name", PRESETS)
def test_zero_action_is_the_replay_bit_for_bit(name, accuracy):
    env = whole(name, accuracy=accuracy)
    sim = skate_env.Simulator(env.scene)
    env.reset(seed=1)
    for _ in range(500):
        *_, terminated, _, info = env.step(ZERO)
        goes_on = sim.step()
        assert terminated is not goes_on
        if terminated:
            break
    assert info["time"] == sim.time
    np.testing.assert_array_equal(env.simulator.q, sim.q)
    np.testing.assert_array_equal(env.simulator.v, sim.v)
    assert info["termination"] == sim.termination
    assert info["support_leg"] == sim.support_leg


@pytest.mark.parametrize(
    ("given", "scale"),
    [
        (None, TORQUE_SCALE),
        (SCALE, SCALE),
        (100.0, dict.fromkeys(TORQUE_SCALE, 100.0)),
        ({"q2": 10.0, "q17": 0.0}, TORQUE_SCALE | {"q2": 10.0, "q17": 0.0}),
    ],
)
def test_action_is_the_scale_times_a_held_torque(given, scale):
    env = IceSkateEnv("paper", joints="all", mirrored=False, action_scale=given)
    env.reset(seed=1)
    sim = skate_env.Simulator("paper")
    action = np.linspace(-0.1, 0.1, 16).astype(np.float32)
    env.step(action)
    sim.step(action.astype(float) * list(scale.values()))
    np.testing.assert_array_equal(env.simulator.q, sim.q)


def test_scale_names_every_joint():
    assert list(TORQUE_SCALE) == skate_env.Simulator("paper").coordinate_names[3:]
    assert list(TORQUE_SCALE) == list(SCALE) == whole("paper").joint_names
    assert IceSkateEnv("paper").joint_names == list(SKATING)


def test_torque_limit_clips_what_the_action_adds_to_the_baseline():
    limit = 60.0
    plain, clipped = (whole("paper", torque_limit=x) for x in (None, limit))
    names = plain.simulator.coordinate_names
    baseline = skate_env.Simulator("paper").torque
    action = np.zeros(16, np.float32)
    joints = [names.index(name) for name in ("q3", "q5", "q6")]
    # The baseline's q3 is below the limit; q5 and q6 reach the limit from either side.
    action[[joint - 3 for joint in joints]] = 0.1, 1.0, -1.0
    for env in (plain, clipped):
        env.reset(seed=0)
        env.step(action)
    sims = [skate_env.Simulator("paper") for _ in range(2)]
    wanted = baseline[3:] + action * list(SCALE.values())
    most = np.maximum(limit, np.abs(baseline[3:]))
    assert (np.abs(wanted) > most).any() and (np.abs(wanted) < most).any()
    sims[0].step(action.astype(float) * list(SCALE.values()))
    sims[1].step(np.clip(wanted, -most, most) - baseline[3:])
    for env, sim in zip((plain, clipped), sims, strict=True):
        # The clipped sum minus the baseline rounds: 3e-14 N m.
        np.testing.assert_allclose(env.simulator.q, sim.q, atol=1e-12)
    assert not np.allclose(plain.simulator.q, clipped.simulator.q, atol=1e-6)


def test_no_limit_holds_the_baseline_alone():
    env = whole("paper", torque_limit=0.0)
    free = whole("paper")
    for each in (env, free):
        each.reset(seed=0)
        for _ in range(100):
            each.step(ZERO)
    np.testing.assert_array_equal(env.simulator.q, free.simulator.q)


def test_residual_is_held_over_the_action_period_and_the_baseline_goes_on():
    # Five short actions are equivalent to one long one; the integrator stops at other times.
    long, short = whole("paper", action_period=0.05), whole("paper")
    action = np.full(16, 0.05, np.float32)
    long.reset(seed=0)
    short.reset(seed=0)
    baseline = []
    for _ in range(4):
        long.step(action)
        for _ in range(5):
            *_, info = short.step(action)
            baseline.append(short.simulator.torque[3:])
    assert info["time"] == pytest.approx(0.2, abs=1e-12)
    # Measured: 1.6e-6 rad, as expected for the tolerance 1e-6.
    np.testing.assert_allclose(long.simulator.q, short.simulator.q, atol=1e-4)
    # The controller's torques vary within each long action.
    assert (np.ptp(np.reshape(baseline, (4, 5, 16)), axis=1).max(axis=1) > 1.0).all()


def test_locked_joints_leave_the_action_space():
    scene = skate_env.load_scene("paper")
    start = {f"start.{x}.{joint}": 0.0 for x in "qv" for joint in ("q10", "q17")}
    env = IceSkateEnv(replace(scene, {"locked": ["q10", "q17"], **start}), joints="all")
    observation, _ = env.reset()
    assert env.action_space.shape == (14,)
    assert "q10" not in env.joint_names and "angle.q10" not in env.observation_names
    assert env.observation_space.contains(observation)
    assert env.observation_space.contains(env.step(np.ones(14))[0])


# --- observations --------------------------------------------------------------------------------


def test_observation_is_what_the_simulator_says():
    env = whole("paper_printed")
    env.reset(seed=0)
    env.action_space.seed(0)
    names = env.observation_names
    last_event, events, compared = 0.0, 0, 0
    for _ in range(250):
        observation, *_ = env.step(0.1 * env.action_space.sample())
        seen = dict(zip(names, observation.tolist(), strict=True))
        sim = env.simulator
        q, v = (dict(zip(sim.coordinate_names, x, strict=True)) for x in (sim.q, sim.v))
        for joint in sim.coordinate_names[2:]:
            wrapped = (q[joint] + np.pi) % (2 * np.pi) - np.pi
            assert seen[f"angle.{joint}"] == pytest.approx(wrapped, abs=3e-7)
            assert seen[f"rate.{joint}"] == np.float32(np.clip(v[joint], -200, 200))
        assert seen["slip.support"] == np.float32(v["y0"])
        assert seen["rise.support"] == np.float32(v["z0"])
        later = env.simulator
        later.take_events()
        if later.advance(sim.time + 1e-6) and not later.take_events():
            heel_toe = [x.link_segments()[6, :, 1:] for x in (sim, later)]
            low = int(np.argmin(heel_toe[0][:, 1]))
            slip = (heel_toe[1][low, 0] - heel_toe[0][low, 0]) / 1e-6
            # Half of 1e-6 s times the acceleration: measured 2e-3.
            assert seen["slip.free"] == pytest.approx(slip, abs=5e-3)
            compared += 1
        gaps = [seen[name] for name in names if name.startswith("height.")]
        np.testing.assert_array_equal(gaps, sim.gaps().ravel().astype(np.float32))
        states = [name for name in names if name.startswith("state.") and seen[name] == 1.0]
        assert states == [f"state.{sim.state_number}"]
        assert seen["support_leg"] == (1.0 if sim.support_leg == "right" else -1.0)
        fresh = sim.take_events()
        events = len(fresh)
        last_event = fresh[-1][0] if fresh else last_event
        assert seen["since_event"] == np.float32(min(sim.time - last_event, 2.0))
        lifting = {"ahead": 0.7716639005767234, "height": 2.0030853108895337}
        ankle = sim.link_segments()[1, 0, 1]
        target = [0.0, ankle + lifting["ahead"], lifting["height"]]
        error = [seen[f"head_error.{axis}"] for axis in "xyz"]
        np.testing.assert_allclose(error, sim.head_position - target, atol=2e-7)
    assert events > 5 and compared > 200


def test_without_lifting_the_head_s_target_is_its_place_when_standing():
    env = whole(replace(skate_env.load_scene("paper_printed"), {"control.lifting": None}))
    env.reset(seed=0)
    names = env.observation_names
    for _ in range(20):
        observation, *_ = env.step(ZERO)
        sim = env.simulator
        target = [0.0, sim.link_segments()[1, 0, 1], 1.70]
        error = [observation[names.index(f"head_error.{axis}")] for axis in "xyz"]
        np.testing.assert_allclose(error, sim.head_position - target, atol=2e-7)


def test_observed_feedforward_is_what_a_scene_without_it_lacks():
    scene = replace(
        skate_env.load_scene("paper_printed"), {"control.arm_swing": {"amplitude": 30.0}}
    )
    other = skate_env.Simulator(
        replace(scene, {"control.feedforward": None, "control.arm_swing": None})
    )
    env = whole(scene)
    env.reset(seed=0)
    peaks = {"q1": 100.0, "q2": 205.0, "q3": 50.0, "q5": 100.0, "q6": 20.0, "q7": 50.0, "q8": 30.0}
    columns = [i for i, x in enumerate(env.observation_names) if x.startswith("feedforward.")]
    joints = [other.coordinate_names.index(joint) for joint in peaks]
    compared, acted = 0, np.zeros(len(peaks), bool)
    for _ in range(500):
        observation, *_ = env.step(ZERO)
        sim = env.simulator
        try:
            other.reset(sim.q, sim.v, sim.support_leg)
        except ValueError:
            continue  # A contact that a start may not have.
        lacking = (sim.torque - other.torque)[joints] / list(peaks.values())
        # Float32, and lifting torques of 1e3 N m: measured 3e-7.
        np.testing.assert_allclose(observation[columns], lacking, atol=1e-6)
        compared += 1
        acted |= np.abs(lacking) > 1e-3
    assert compared > 300 and acted.all()


def test_observed_phase_is_that_of_the_printed_cosines():
    env = whole("paper")
    env.reset(seed=0)
    seen = {}
    for _ in range(500):
        observation, *_, info = env.step(ZERO)
        row = dict(zip(env.observation_names, observation.tolist(), strict=True))
        assert np.hypot(row["phase.sin"], row["phase.cos"]) == pytest.approx(1.0, abs=1e-6)
        # tau5 in state 3, tau2 in state 7, tau2 in states 14 and 16.
        amplitude = {3: ("tau5", 0.5), 7: ("tau2", -1.0), 16: ("tau2", -75.0 / 205.0)}
        if (state := info["state_number"]) in amplitude and row["since_event"] > 2e-3:
            tau, factor = amplitude[state]
            wave = factor * row["phase.cos"]
            assert row[f"feedforward.{tau}"] == pytest.approx(wave, abs=1e-6)
            seen[state] = seen.get(state, 0) + 1
    assert len(seen) == 3 and min(seen.values()) > 1, seen


def test_observations_stay_inside_the_space_under_full_random_actions():
    env = whole("paper")
    env.action_space.seed(0)
    for _ in range(20):
        observation, _ = env.reset()
        for _ in range(200):
            assert env.observation_space.contains(observation)
            observation, _, terminated, _, info = env.step(env.action_space.sample())
            if terminated:
                assert info["termination"]
                break
        assert env.observation_space.contains(observation)


# --- episodes ------------------------------------------------------------------------------------


def test_same_seed_same_episode_and_another_another():
    def episode(seed):
        env = whole("paper", perturb=0.01)
        env.action_space.seed(seed)
        env.reset(seed=seed)
        return np.array([env.step(0.01 * env.action_space.sample())[0] for _ in range(20)])

    np.testing.assert_array_equal(episode(5), episode(5))
    assert not np.array_equal(episode(5), episode(6))


def test_second_reset_without_a_seed_draws_a_new_start():
    env = whole("paper", perturb=0.01)
    first, _ = env.reset(seed=5)
    second, _ = env.reset()
    again, _ = env.reset(seed=5)
    assert not np.array_equal(first, second)
    np.testing.assert_array_equal(first, again)
    # Without a seed every environment has a different start.
    starts = [whole("paper", perturb=0.01).reset()[0] for _ in range(2)]
    assert not np.array_equal(*starts)


def test_a_fall_terminates_with_its_cause():
    env = whole(replace(skate_env.load_scene("paper"), {"fall.head_height": 2.9}))
    env.reset()
    _, _, terminated, truncated, info = env.step(ZERO)
    assert terminated is True and truncated is False
    assert info["termination"] == "fall"


def test_every_cause_terminates():
    # Stiff stabilizers end with step_limit, where no implicit method takes over.
    stops = {"stiffness": 1e6, "damping": 10.0}
    changes = {"stabilizers.knee_stop": stops, "fall": None, "accuracy": 5e-6}
    env = whole(replace(skate_env.load_scene("push_only"), changes))
    env.action_space.seed(1)
    causes = set()
    for episode in range(10):
        env.reset(seed=episode)
        for _ in range(300):
            *_, terminated, truncated, info = env.step(env.action_space.sample())
            assert terminated is (info["termination"] is not None) and truncated is False
            if terminated:
                causes.add(info["termination"])
                break
    assert causes and causes <= set(skate_env._core.TERMINATIONS)


def test_only_the_time_limit_truncates():
    env = gymnasium.make("IceSkate-v0", max_episode_steps=4)
    env.reset()
    ends = [env.step(np.zeros(env.action_space.shape))[2:4] for _ in range(4)]
    assert ends == [(False, False)] * 3 + [(False, True)]
    # By default after 30 s.
    usual = gymnasium.spec("IceSkate-v0").max_episode_steps
    assert usual * env.unwrapped.action_period == pytest.approx(30.0)


def test_infos_have_the_same_keys_always_and_plain_values():
    env = whole("paper")
    _, begun = env.reset(seed=0)
    *_, stepped = env.step(ZERO)
    assert list(begun) == list(stepped)
    assert {type(value) for value in stepped.values()} == {float, int, str, type(None)}
    assert all(begun[key] == 0.0 for key in begun if key.startswith("reward"))
