"""The study's motions in MuJoCo: the same body, the expected orders, and its limits."""

import mujoco
import numpy as np
import pytest

from skate_env import Simulator
from skate_env.studies.accuracy.mujoco import block, limit, run, settings
from skate_env.studies.accuracy.outcome import Outcome
from skate_env.studies.motions.cases import Case, cases
from skate_env.studies.motions.mujoco_model import (
    CONTACTS,
    ELLIPTIC,
    PYRAMIDAL,
    Setting,
    is_fixed,
    load,
)
from skate_env.studies.motions.mujoco_motion import Motion

CASES = {name: case for name, case in cases().items() if case.in_mujoco}
RIGID = {"slide": "gliding fine", "landing": "firm"}


def engine(case: Case, start: int = 0) -> Simulator:
    period = {"control.action_period": case.duration}
    sim = Simulator(case.with_accuracy(1e-12).with_values(period))
    sim.reset(*case.start(start))
    assert sim.step(case.torque)
    return sim


def error(case: Case, outcome: Outcome) -> float:
    return float(np.abs(outcome.q - engine(case).q).max())


@pytest.mark.parametrize("name", CASES)
def test_same_body(name: str) -> None:
    """M, bias and damping agree."""
    case = CASES[name]
    cone, contact = (None, None) if case.smooth else (PYRAMIDAL, "default")
    model = load(case, Setting("Euler", 1e-3, cone, contact))
    data = mujoco.MjData(model)
    sim = Simulator(case.scene)
    rng = np.random.default_rng(1)
    q, v = rng.uniform(-1.0, 1.0, (2, len(sim.q)))
    held = 3 if is_fixed(case) else 0
    v[:held] = 0.0
    if held:
        q[:held] = 0.0
    data.qpos[:], data.qvel[:] = q[held:], v[held:]
    mujoco.mj_forward(model, data)
    # The arguments of mj_fullM depend on the version.
    mass = np.zeros((model.nv, model.nv))
    for column, unit in zip(mass, np.eye(model.nv), strict=True):
        mujoco.mj_mulM(model, data, column, unit)
    np.testing.assert_allclose(mass, sim.mass_matrix(q)[held:, held:], atol=1e-11)
    np.testing.assert_allclose(data.qfrc_bias, sim.bias_forces(q, v)[held:], atol=1e-10)
    damping = np.array([0.0, 0.0, *(body["damping"] for body in sim.bodies())])
    np.testing.assert_array_equal(model.dof_damping, damping[held:])


@pytest.mark.parametrize(
    ("name", "integrator", "order", "steps"),
    [
        ("swing", "Euler", 1, (2.5e-3, 1.25e-3)),
        ("swing", "implicitfast", 1, (2.5e-3, 1.25e-3)),
        # Above 1.6 ms the damping of the hands makes this method unstable.
        ("swing", "RK4", 4, (3.125e-4, 1.5625e-4)),
        ("flight", "Euler", 1, (2.5e-3, 1.25e-3)),
        ("flight", "RK4", 4, (2e-2, 1e-2)),
    ],
)
def test_order(name: str, integrator: str, order: int, steps: tuple[float, float]) -> None:
    case = CASES[name]
    coarse, fine = (error(case, run(case, Setting(integrator, step), 0)) for step in steps)
    assert np.log2(coarse / fine) == pytest.approx(order, abs=0.25)


@pytest.mark.parametrize(("name", "step"), [("swing", 1.5625e-4), ("flight", 1.25e-3)])
def test_agrees_without_contact(name: str, step: float) -> None:
    """Different programs and methods give the same end: measured 2e-10 and 4e-11."""
    case = CASES[name]
    outcome, sim = run(case, Setting("RK4", step), 0), engine(case)
    assert outcome.termination is None
    assert outcome.time == pytest.approx(case.duration, rel=1e-12)
    np.testing.assert_allclose(outcome.q, sim.q, rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(outcome.v, sim.v, rtol=0.0, atol=1e-8)


@pytest.mark.parametrize(("name", "start"), [("slide", 0), ("landing", 0), ("landing", 1)])
def test_stiff_contact_converges_to_rigid_contact(name: str, start: int) -> None:
    """At 0.04 ms the best contact settings deviate by 5e-5 (slide) and 3e-5 (landing)."""
    case = CASES[name]
    outcome = run(case, Setting("Euler", 3.90625e-5, ELLIPTIC, RIGID[name]), start)
    sim = engine(case, start)
    begun = Simulator(case.scene)
    begun.reset(*case.start(start))
    np.testing.assert_allclose(outcome.q, sim.q, rtol=0.0, atol=1.5e-4)
    assert outcome.slide == pytest.approx(sim.q[0] - begun.q[0], abs=1e-4)
    assert outcome.penetration is not None and outcome.penetration < 5e-6


def test_default_contact_has_another_limit() -> None:
    """It converges to a foot that penetrates the ice: 0.016 rad from rigid contact."""
    case = CASES["landing"]
    soft = limit(case, PYRAMIDAL, "default")
    outcome = run(case, Setting("Euler", 3.90625e-5, PYRAMIDAL, "default"), 0)
    assert np.abs(outcome.q - soft.q).max() < 2e-3
    assert 0.01 < error(case, outcome) < 0.03


def test_friction_depends_on_the_direction() -> None:
    """The friction coefficient depends on the lower sole end, here the heel of a rotating foot."""
    motion = Motion(CASES["slide"], Setting("Euler", 1e-6, ELLIPTIC, "gliding"), 0)
    for along, turning, coefficient in [(1.0, 0.0, 0.2), (-1.0, 0.0, 0.9), (0.1, -4.0, 0.9)]:
        # Above the ice.
        motion.data.qpos[1:3] = 0.1
        motion.data.qvel[:] = 0.0
        motion.data.qvel[0], motion.data.qvel[2] = along, turning
        motion.advance(1)
        np.testing.assert_array_equal(motion.model.pair_friction[:, :2], coefficient)


def test_an_unstable_run_counts_as_a_failure(capfd: pytest.CaptureFixture[str]) -> None:
    """RK4 at 20 ms is unstable with this damping; MuJoCo resets, which counts as a failure."""
    outcome = run(CASES["swing"], Setting("RK4", 0.02), 0)
    assert outcome.termination == "not_finite"
    assert outcome.time < CASES["swing"].duration
    captured = capfd.readouterr()
    assert captured.out == captured.err == ""


@pytest.mark.parametrize("name", CASES)
def test_settings(name: str) -> None:
    case = CASES[name]
    every = settings(case)
    assert len(set(every)) == len(every)
    assert set(settings(case, quick=True)) < set(every)
    for setting in every:
        steps = case.duration / setting.timestep
        assert steps == pytest.approx(round(steps), abs=1e-6)
        assert (setting.cone is None) == case.smooth
        assert setting.contact is None or CONTACTS[setting.contact].label in setting.method


@pytest.mark.parametrize("name", CASES)
def test_block_covers_the_motion(name: str) -> None:
    case = CASES[name]
    for setting in settings(case, quick=True)[1:3]:
        work, covered = block(case, setting)
        assert 0.0 < covered <= case.duration * (1 + 1e-9)
        assert work() > 0
