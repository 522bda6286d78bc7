"""The closed step on push-only ice in the paper's order."""

import numpy as np

from training.push_only_orbit import load, replay


def test_the_step_repeats_in_order_with_admissible_forces() -> None:
    sim, torques = load()
    made = replay(sim, torques)
    assert sim.scene.parameters()["control.feedforward.scale"][0] == 0.2
    assert made.residual < 1e-9  # 9e-12
    assert made.order.in_order()
    assert made.order.double > 0.03  # 0.477 s
    assert np.abs(torques).max() <= 150.0  # 140.5 N m
    assert made.record["inadmissible_time"] == 0.0
    assert made.loads.min() >= 0.0
