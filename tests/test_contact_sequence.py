"""The contact-state sequence of the paper: what policies keep of it."""

import numpy as np
import pytest

from skate_env.gait import step_orders
from skate_env.learning.rollouts import DOUBLE, Conditions, run
from skate_env.policies import Policy, baseline, shipped


def events(*states):
    """States in sequence from 0 s on, 10 ms each."""
    return [(0.01 * i, "", 0, state, "right") for i, state in enumerate(states)]


@pytest.mark.parametrize(
    ("states", "reached"),
    [
        ((3, 7, 15, 16, 14), 5),
        # Other states and repetitions may occur in between.
        ((4, 3, 4, 3, 8, 7, 16, 7, 15, 16, 4, 16, 14, 16), 5),
        ((3, 7, 15, 16), 4),
        # Each state counts after its predecessors only.
        ((7, 3, 15, 16, 14), 1),
        ((3, 15, 7, 16, 14), 2),
        ((4, 0, 4, 8), 0),
    ],
)
def test_the_order_is_followed_state_by_state(states, reached):
    (step,) = step_orders(events(*states), [0.0, 0.01 * len(states)])
    assert step.reached == reached


def test_times_are_those_between_the_swaps():
    #                  0  10 20  30  40  50 60 ms
    told = events(3, 7, 15, 16, 14, 4, 3)
    (whole,) = step_orders(told, [0.0, 0.06])
    # 7, 15, 16 and 14 have both feet on the ice; 4 is not part of the sequence.
    assert whole.double == pytest.approx(0.04) and whole.other_time == pytest.approx(0.01)
    first, second = step_orders(told, [0.0, 0.025, 0.06])
    assert (first.reached, second.reached) == (3, 0)
    assert first.double == pytest.approx(0.015) and second.double == pytest.approx(0.025)
    # The last state continues.
    assert step_orders(told, [0.05, 0.2])[0].other_time == pytest.approx(0.01)


def test_no_step_has_no_order():
    assert step_orders(events(3, 7), []) == step_orders(events(3, 7), [0.01]) == []


def test_the_baseline_of_paper_keeps_the_order():
    controller = baseline.no_residual("paper")
    figures = run(controller, {"scene": controller.scene}, Conditions(episodes=1, steps=4))
    assert figures["in_order"] == figures["in_order_to_16"] == figures["long_heel_and_flat"] == 1.0
    assert DOUBLE / figures["period"] < figures["double_support"]
    # The mean over the whole time, the median over the steps: 4 steps here, 0.254 s and 0.259 s.
    mean = figures["period"] * figures["double_support"]
    assert figures["heel_and_flat"] == pytest.approx(mean, rel=0.05)


def test_the_shipped_policy_of_push_only_does_not_keep_the_order():
    """It lands while the other foot is on its toe: docs/research-notes.md."""
    policy = Policy.load(shipped("push_only"))
    conditions = Conditions(episodes=1, steps=10, disturbances={"perturb": 0.02})
    figures = run(policy, policy.environment(), conditions)
    assert figures["steps"] == 10 and np.all(figures["in_order_to_16"] == 0.0)
