"""The collocation's model of the robot is that of the engine, and its feedback is optimal."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("casadi")

from skate_env import Simulator, load_scene
from skate_env.scenes import Mirror
from training.orbits.push_only import TICK, load
from training.trajectory import __main__ as command
from training.trajectory import closing
from training.trajectory.__main__ import LEAD
from training.trajectory.dynamics import PHASES, Dynamics, swapped
from training.trajectory.limits import Limits
from training.trajectory.robot import Robot, numbers
from training.trajectory.solution import Solution
from training.trajectory.solution import load as load_solution

FOOT, HEAD = (0.17, 0.07, 0.07), 0.24


def test_inverse_dynamics_are_those_of_the_engine() -> None:
    random = np.random.default_rng(0)
    sim = Simulator(load_scene("push_only"))
    robot = Robot(sim, FOOT, HEAD)
    for _ in range(5):
        q, v, a = random.normal(size=(3, 19))
        engine = sim.mass_matrix(q) @ a + sim.bias_forces(q, v)
        np.testing.assert_allclose(numbers(robot.inverse_dynamics(q, v, a)), engine, atol=1e-10)


def test_the_phases_have_the_equations_of_the_engine() -> None:
    sim, torques = load()
    values = sim.scene.parameters()
    parts = ("K_p.1", "K_p.2", "ahead", "height")
    parameters = [values[f"control.lifting.{part}"][0] for part in parts]
    dynamics = Dynamics(Robot(sim, FOOT, HEAD), values["control.feedforward.scale"][0])
    by_state = {phase.state: phase for phase in PHASES}
    checked = set()
    for i, torque in enumerate(torques[:-2]):
        assert sim.advance((i + 1) * TICK, torque)
        begun = dict(zip(("swing", "landing", "push"), sim.state_vector()[-3:], strict=True))
        phase = by_state.get(sim.state_number)
        changed = max([0.0, *(event[0] for event in sim.take_events())])
        # Torques are those of the last sample, up to 1 ms after an event.
        if phase is None or changed > (i - 1) * TICK > 0.0:
            continue
        loads = sim.contact_forces
        lam = [*loads[0, [2, 3, 0]], *loads[1, [2, 3, 0]]]
        since = sim.time - begun[phase.law] if phase.law else 0.0
        equations = dynamics.equations(phase, phase.law)
        zero, total = equations(sim.q, sim.v, sim.acceleration, lam, torque, since, parameters)
        np.testing.assert_allclose(numbers(total), sim.torque[3:], atol=1e-6)
        np.testing.assert_allclose(numbers(zero), 0.0, atol=1e-6)
        checked.add(phase.state)
    assert checked == set(by_state)


def test_the_swap_is_that_of_the_engine_in_a_mirror() -> None:
    sim, torques = load()
    mirror, leg, before = Mirror(sim.coordinate_names), sim.support_leg, sim.q
    for i, torque in enumerate(torques):
        before = sim.q
        # The legs swap at the beginning of a tick.
        assert sim.advance(i * TICK + 1e-9, torque)
        if sim.support_leg != leg:
            break
        assert sim.advance((i + 1) * TICK, torque)
    toe = numbers(Robot(sim, FOOT, HEAD).ends(before))[3]
    q = numbers(swapped([*toe, 0.0], before))
    np.testing.assert_allclose(q, mirror(sim.q), atol=1e-6)


def test_gains_solve_the_linear_quadratic_problem() -> None:
    random = np.random.default_rng(0)
    parts = [(np.eye(38) + 0.02 * random.normal(size=(38, 38)), random.normal(size=(38, 16)) / 40)]
    parts = [*parts, *((A, B + 0.01) for A, B in parts), *parts]
    end, slope, x = (
        np.diag(random.uniform(1, 2, 38)),
        random.normal(size=38),
        random.normal(size=38),
    )
    K, k = closing.gains(parts, end, slope)

    def cost(change: np.ndarray) -> float:
        state, total = x, 0.0
        for (A, B), gain, affine, more in zip(parts, K, k, change, strict=True):
            u = -gain @ state - affine + more
            total += closing.TORQUE * u @ u + state @ (closing.DEVIATION * state)
            state = A @ state + B @ u
        return float(total + state @ end @ state + 2.0 * slope @ state)

    least = cost(np.zeros((3, 16)))
    for _ in range(20):
        change = 1e-3 * random.normal(size=(3, 16))
        # A minimum: both sides cost more, and by the same.
        more = cost(change) - least, cost(-change) - least
        assert min(more) > 0.0
        np.testing.assert_allclose(more[0], more[1], rtol=1e-6)


def test_a_solution_is_the_polynomial_through_its_points(tmp_path: Path) -> None:
    random = np.random.default_rng(0)
    step = load_solution(LEAD)
    # The last phase begins where the one before it ends.
    coefficients, last = random.normal(size=(38, 4)), len(PHASES) - 1

    def cubic(place: float) -> np.ndarray:
        return coefficients @ place ** np.arange(4.0)

    for phase, begin in ((last - 1, -1.0), (last, 0.0)):
        step.states[phase][:] = np.transpose([cubic(begin + at) for at in step.places(phase)])
    for place in (0.0, 0.01, 0.5, 0.97, 1.0):
        np.testing.assert_allclose(step.state(last, place), cubic(place), atol=1e-12)
    step.save(tmp_path / "step.npz")
    again = load_solution(tmp_path / "step.npz")
    np.testing.assert_array_equal(again.state(2, 0.3), step.state(2, 0.3))
    np.testing.assert_array_equal(again.torque(2, 0.3), step.torque(2, 0.3))
    assert again.foot == step.foot


def test_problems_are_solved_one_from_the_other(monkeypatch: pytest.MonkeyPatch) -> None:
    lead, seen = load_solution(LEAD), []

    def solve(limits: Limits, guess: Solution, show: bool) -> tuple[Solution, str, float]:
        seen.append((guess.scale, limits.lift, guess.durations[0]))
        return replace(guess, durations=guess.durations + 1.0), "Solve_Succeeded", 0.0

    monkeypatch.setattr(command, "solve", solve)
    step = command.solved(lead, [(0.3, Limits()), (0.5, Limits(lift=1.0))])
    first = lead.durations[0]
    assert seen == [(0.3, Limits().lift, first), (0.5, 1.0, first + 1.0)]
    assert (step.scale, step.durations[0]) == (0.5, first + 2.0)
