"""The closed step on push-only ice in the paper's order."""

import numpy as np

from training.push_only_orbit import load, replay

BODY_WEIGHT = 64.0 * 9.81


def test_the_step_repeats_in_order_with_admissible_forces() -> None:
    sim, torques = load()
    made = replay(sim, torques)
    assert sim.scene.parameters()["control.feedforward.scale"][0] == 0.2
    assert made.residual < 1e-9  # 2e-13
    assert made.order.in_order()
    assert made.order.double > 0.03  # 0.323 s
    assert np.abs(torques).max() <= 150.0  # 136.0 N m
    assert made.record["inadmissible_time"] == 0.0
    assert made.loads.min() >= 0.0


def test_the_step_is_within_the_limits_of_a_human() -> None:
    sim, torques = load()
    made = replay(sim, torques)
    assert made.torque <= 350.0  # 342 N m
    assert made.lift <= BODY_WEIGHT  # 0.99 of it
    values = sim.scene.parameters()
    sole = values["body.foot.toe"][0] + values["body.foot.heel"][0]
    assert 0.22 <= sole <= 0.28  # 0.24 m
    assert values["control.lifting.height"][0] <= 1.72  # 1.667 m
    assert values["control.lifting.ahead"][0] <= 0.5  # 0.499 m
    in_air = sum(time for state, time in made.order.visits if state in range(1, 5))
    assert in_air >= 0.5 * sum(time for _, time in made.order.visits)  # 0.507
