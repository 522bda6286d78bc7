"""Imitation of the closed step on push-only ice."""

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("stable_baselines3")

from skate_env import Policy
from skate_env.gait import ORDER, StepOrder
from skate_env.learning.rollouts import Conditions, run
from training.imitation.env import ACTION_SCALE, ImitationVecEnv, Terms
from training.imitation.reference import reference, scene
from training.orbits.push_only import load

PERIOD = 0.001


def environments(n: int = 1) -> ImitationVecEnv:
    step = reference()
    made = scene(step, 0.2, PERIOD)
    return ImitationVecEnv(
        n, made, step, Terms(), middle=0.0, perturb=0.0, seed=0, max_episode_steps=10**6
    )


def test_the_reference_is_the_step_in_order() -> None:
    step = reference()
    kept = step.states[np.flatnonzero(np.diff(step.states, prepend=-1))]
    assert [state for state in kept if state in ORDER][: len(ORDER)] == list(ORDER)
    assert 0.65 < step.duration < 0.66
    np.testing.assert_array_equal(step.q[:, 0], 0.0)


def test_a_motion_on_the_step_earns_the_whole_imitation_reward() -> None:
    envs, (_, torques), terms = environments(), load(), Terms()
    envs.reset()
    scale = np.array([ACTION_SCALE[name] for name in envs.batch.joint_names])
    most = (terms.pose + terms.velocity + terms.slip + terms.contact) * PERIOD
    checked = 0
    for row in range(0, 650, 25):
        started = envs._start_at(0, row)
        if started is None or envs.batch.simulator(0).state_number != envs._step.states[row]:
            # Without the step's torques the contact is another one.
            continue
        envs._time[0] = PERIOD * row
        # The neck of the step has more torque than a full action.
        action = np.clip(torques[row] / scale, -1.0, 1.0)
        _, reward, over, _ = envs.step(action[None].astype(np.float32))
        assert not over[0]
        assert 0.99 * most < reward[0] <= most, row  # 0.996 and more
        checked += 1
    assert checked > 8  # 9


def test_a_short_step_pays_less_than_a_long_one_and_a_wrong_order_least() -> None:
    envs = environments()
    good = StepOrder(((3, 0.25), (7, 0.015), (15, 0.22), (16, 0.12), (14, 0.12)))
    brief = StepOrder(((3, 0.25), (7, 0.015), (15, 0.01), (16, 0.01), (14, 0.02)))
    none = StepOrder(((3, 0.7),))
    swap_rewards = [
        envs._swap_reward(good, 0.729),
        envs._swap_reward(good, 0.4),
        envs._swap_reward(brief, 0.3),
        envs._swap_reward(none, 0.7),
    ]
    assert swap_rewards == sorted(swap_rewards, reverse=True)
    assert swap_rewards[-1] < 0.1 * swap_rewards[0]


def test_falls_and_strange_motions_end_an_episode_with_the_penalty() -> None:
    envs = environments(4)
    envs.reset()
    actions = np.full((4, 16), 1.0, np.float32)
    for _ in range(800):
        _, reward, over, _ = envs.step(actions)
        if over.any():
            break
    np.testing.assert_array_less(reward[over], -0.9 * Terms().end)
    # The next episode starts on the step.
    row = np.flatnonzero(over)[0]
    start = envs.batch.simulator(row)
    np.testing.assert_allclose(start.q[1:], reference().q[0, 1:], atol=1e-12)


def test_two_swaps_within_an_action_are_an_early_swap() -> None:
    envs = environments()
    envs.reset()
    # Ends of the sole lift off and land.
    for _ in range(100):
        assert not envs.step(np.zeros((1, 16), np.float32))[2][0]
    envs._time[:] = 0.5 * Terms().shortest
    unchanged, twice = ({"support_leg": "right", "steps": steps} for steps in (0, 1))
    running = np.zeros(1, np.bool_)
    assert not envs._swaps(running, [unchanged])[1][0]
    # The leg is the same again, but a step has been counted.
    assert envs._swaps(running, [twice])[1][0]


@pytest.mark.long("the policy makes 100 steps in the paper's order")
def test_the_policy_keeps_the_order_on_push_only_ice() -> None:
    path = Path(__file__).parents[1] / "training" / "imitation" / "policies" / "push_only_order.npz"
    policy = Policy.load(path)
    conditions = Conditions(episodes=32, disturbances={"perturb": 0.01, "trunk_noise": 0.01})
    made = run(policy, policy.environment(), conditions)
    assert np.mean(made["in_order"] * made["long_heel_and_flat"] * made["completed"]) > 0.9
    np.testing.assert_array_equal(made["inadmissible"], 0.0)
    assert max(policy.action_scale.values()) <= 150.0
