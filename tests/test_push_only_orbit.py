"""The closed step on push-only ice in the paper's order."""

from collections.abc import Iterator

import numpy as np
import pytest

from skate_env import Simulator, _core
from skate_env.gait import step_orders
from skate_env.policies import OrbitPolicy
from skate_env.scenes import replace
from training.orbits import feedback
from training.orbits.push_only import (
    FILE,
    SCALE,
    TICK,
    WAIST,
    WEIGHT,
    load,
    orbit,
    replay,
    with_tau8,
)

BODY_WEIGHT = 64.0 * 9.81


# Steps with parts of the published torques.
STEPS = {0.2: FILE, 1.0: FILE.with_name("push_only_all.npz")}


@pytest.mark.parametrize("part", STEPS)
def test_the_step_repeats_in_order_with_admissible_forces(part: float) -> None:
    sim, torques = load(STEPS[part])
    made = replay(sim, torques)
    assert sim.scene.parameters()["control.feedforward.scale"][0] == part
    assert made.residual < 1e-9  # 2e-13, 3e-13
    assert made.order.in_order()
    assert made.order.double > 0.03  # 0.323, 0.296 s
    assert np.abs(torques).max() <= 150.0  # 136.0 N m
    assert made.record["inadmissible_time"] == 0.0
    assert made.loads.min() >= 0.0


@pytest.mark.parametrize("part", STEPS)
def test_the_step_is_within_the_limits_of_a_human(part: float) -> None:
    sim, torques = load(STEPS[part])
    made = replay(sim, torques)
    assert made.torque <= 350.0  # 342, 337 N m
    assert made.lift <= BODY_WEIGHT  # 0.99, 0.92 of it
    values = sim.scene.parameters()
    sole = values["body.foot.toe"][0] + values["body.foot.heel"][0]
    assert 0.22 <= sole <= 0.28  # 0.24 m
    assert values["control.lifting.height"][0] <= 1.72  # 1.667 m
    assert values["control.lifting.ahead"][0] <= 0.5  # 0.499 m
    in_air = sum(time for state, time in made.order.visits if state in range(1, 5))
    assert in_air >= 0.5 * sum(time for _, time in made.order.visits)  # 0.507


def test_the_step_closes_with_the_memory_of_the_controller() -> None:
    """A reset sets the time of the last swap to that of the start; the orbit has its own."""
    closed = orbit(*load())
    assert closed.size < 1e-9  # 2e-12
    assert closed.start.torques is not None
    assert np.abs(closed.start.torques).max() <= 150.0


def skated(
    sim: _core.Simulator, policy: OrbitPolicy, number: int, swaps: list[float]
) -> Iterator[None]:
    """Skate a number of steps, and add their swaps; yield after every millisecond."""
    while len(swaps) < number:
        assert sim.advance(sim.time + TICK, policy.residual(sim))
        steps = sim.take_steps()
        assert all(step["inadmissible_time"] == 0.0 for step in steps)
        swaps += [step["time"] for step in steps]
        yield


@pytest.mark.long("five steps with an action each millisecond")
def test_feedback_follows_the_step_in_order_within_the_limits() -> None:
    policy = feedback.design(orbit(*load()), SCALE, weight=WEIGHT)
    sim = Simulator(replace(policy.scene, {"accuracy": "balanced"}))
    sim.perturb(0.01, 1)
    values = sim.scene.parameters()
    stiffness, height = (values[f"control.lifting.{name}"][0] for name in ("K_p.2", "height"))
    swaps: list[float] = []
    for _ in skated(sim, policy, 5, swaps):
        assert np.abs(sim.torque).max() <= 350.0  # 345 N m
        lift = stiffness * (height - sim.head_position[2])
        assert abs(lift) <= BODY_WEIGHT  # 0.996 of it
        assert sim.contact_forces[:, 2:].min() >= 0.0
    orders = step_orders(sim.take_events(), swaps)
    assert all(order.in_order() for order in orders)
    assert min(order.double for order in orders) > 0.03  # 0.32 s


@pytest.mark.long("steps with all of the published torques")
def test_feedback_keeps_the_order_with_all_of_the_published_torques() -> None:
    closed = orbit(*load(STEPS[1.0]))
    policy = feedback.design(closed, SCALE, weight=0.03, after_swap=True)
    for seed in range(3):
        sim = Simulator(policy.scene)
        sim.perturb(0.005, seed)
        swaps: list[float] = []
        for _ in skated(sim, policy, 6, swaps):
            assert np.abs(sim.torque).max() <= 350.0  # 337 N m on the orbit
        assert all(order.in_order() for order in step_orders(sim.take_events(), swaps))


@pytest.mark.long("closes the step with tau8, and skates eight steps")
def test_tau8_turns_the_waist_without_a_residual_torque_and_the_arms_swing_opposed() -> None:
    closed = with_tau8(orbit(*load()), 6.0)
    assert closed.size < 1e-9 and closed.start.torques is not None
    waist = list(SCALE).index(WAIST)
    assert not closed.start.torques[:, waist].any()
    policy = feedback.design(closed, SCALE | {WAIST: 0.0}, weight=WEIGHT)
    sim = Simulator(policy.scene)
    shoulders = [sim.coordinate_names.index(name) for name in ("q11", "q14")]
    swaps: list[float] = []
    angles = []
    for _ in skated(sim, policy, 8, swaps):
        assert policy.residual(sim)[waist] == 0.0
        angles.append(sim.q[shoulders])
    assert all(order.in_order() for order in step_orders(sim.take_events(), swaps))
    assert np.corrcoef(np.transpose(angles))[0, 1] < -0.7  # -0.92
