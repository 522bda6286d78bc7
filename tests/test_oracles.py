"""Mass matrix, bias, energy and momentum against MuJoCo and Pinocchio on 1,000 random states.

Residuals are relative to the largest entry of the quantity in that state. The comment next to each
tolerance is the largest measured residual over all bodies below.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np
import pinocchio
import pytest
from numpy.typing import NDArray

from skate_env import Scene, Simulator, _core, to_mjcf

Array = NDArray[np.float64]

STATES = 1000
LOCKED = {
    "whole": [],
    "no_yaw": ["q8"],
    "stiff_trunk": ["q8", "q9", "q10"],
    "uneven": ["q8", "q11", "q12", "q16"],
    "no_arms": ["q11", "q12", "q13", "q14", "q15", "q16"],
    "legs_only": [f"q{i}" for i in range(8, 18)],
}
BODIES = {f"{name}_{leg}": (LOCKED[name], leg) for name in LOCKED for leg in ("right", "left")}


@dataclass
class Case:
    """One body in all three libraries, with the test states."""

    ours: _core.Simulator
    mujoco: mujoco.MjModel
    pinocchio: pinocchio.Model
    q: Array
    v: Array


@pytest.fixture(scope="module", params=BODIES.values(), ids=BODIES.keys())
def case(
    request: pytest.FixtureRequest,
    paper: Callable[..., Scene],
    tmp_path_factory: pytest.TempPathFactory,
) -> Case:
    locked, leg = request.param
    scene = paper(locked=locked, **{"start.support_leg": leg})
    ours = Simulator(scene)
    path: Path = tmp_path_factory.mktemp("mjcf") / "robot.xml"
    path.write_text(to_mjcf(scene))
    shape = (STATES, len(ours.coordinate_names))
    rng = np.random.default_rng(20240229)
    return Case(
        ours,
        mujoco.MjModel.from_xml_path(str(path)),
        pinocchio.buildModelFromMJCF(str(path)),
        rng.uniform(-1.5, 1.5, shape),
        rng.uniform(-10.0, 10.0, shape),
    )


def residual(ours: Array, theirs: Array) -> float:
    """Largest deviation over all states, relative to the largest entry in the state."""
    axes = tuple(range(1, theirs.ndim))
    return float((np.abs(ours - theirs).max(axes) / np.abs(theirs).max(axes)).max())


def about_origin(linear: Array, angular: Array, centre_of_mass: Array) -> Array:
    """p_y, p_z and L_x about the origin, from the angular momentum about the centre of mass."""
    return np.array([*linear[1:], (angular + np.cross(centre_of_mass, linear))[0]])


@pytest.fixture(scope="module")
def ours(case: Case) -> dict[str, Array]:
    sim = case.ours
    states = list(zip(case.q, case.v, strict=True))
    return {
        "M": np.array([sim.mass_matrix(q) for q in case.q]),
        "h": np.array([sim.bias_forces(q, v) for q, v in states]),
        "energy": np.array([sim.energy(q, v) for q, v in states]),
        "momentum": np.array([sim.momentum(q, v) for q, v in states]),
    }


@pytest.fixture(scope="module")
def from_mujoco(case: Case) -> dict[str, Array]:
    model = case.mujoco
    model.opt.enableflags |= mujoco.mjtEnableBit.mjENBL_ENERGY
    data = mujoco.MjData(model)
    identity = np.eye(model.nv)
    M = np.empty((STATES, model.nv, model.nv))
    h = np.empty((STATES, model.nv))
    energy = np.empty((STATES, 2))
    momentum = np.empty((STATES, 3))
    for i in range(STATES):
        data.qpos, data.qvel = case.q[i], case.v[i]
        mujoco.mj_forward(model, data)
        # The arguments of mj_fullM depend on the version.
        for column in range(model.nv):
            mujoco.mj_mulM(model, data, M[i, column], identity[column])
        h[i] = data.qfrc_bias
        potential, kinetic = data.energy
        energy[i] = kinetic, potential
        mujoco.mj_subtreeVel(model, data)
        linear = model.body_subtreemass[0] * data.subtree_linvel[0]
        momentum[i] = about_origin(linear, data.subtree_angmom[0], data.subtree_com[0])
    return {"M": M, "h": h, "energy": energy, "momentum": momentum}


@pytest.fixture(scope="module")
def from_pinocchio(case: Case) -> dict[str, Array]:
    model = case.pinocchio
    data = model.createData()
    at_rest = np.zeros(model.nv)
    M = np.empty((STATES, model.nv, model.nv))
    h = np.empty((STATES, model.nv))
    momentum = np.empty((STATES, 3))
    for i, (q, v) in enumerate(zip(case.q, case.v, strict=True)):
        upper = np.triu(pinocchio.crba(model, data, q))
        M[i] = upper + np.triu(upper, 1).T
        h[i] = pinocchio.rnea(model, data, q, v, at_rest)
        about_com = pinocchio.computeCentroidalMomentum(model, data, q, v)
        momentum[i] = about_origin(about_com.linear, about_com.angular, data.com[0])
    return {"M": M, "h": h, "momentum": momentum}


def test_mass_matrix(
    ours: dict[str, Array], from_mujoco: dict[str, Array], from_pinocchio: dict[str, Array]
) -> None:
    assert residual(ours["M"], from_mujoco["M"]) < 1e-10  # 1.5e-15
    assert residual(ours["M"], from_pinocchio["M"]) < 1e-10  # 1.2e-15


def test_mass_matrix_is_symmetric_and_positive_definite(ours: dict[str, Array]) -> None:
    M = ours["M"]
    np.testing.assert_array_equal(M, M.transpose(0, 2, 1))
    assert np.linalg.eigvalsh(M).min() > 1e-4  # 1.6e-3


def test_bias_forces(
    ours: dict[str, Array], from_mujoco: dict[str, Array], from_pinocchio: dict[str, Array]
) -> None:
    assert residual(ours["h"], from_mujoco["h"]) < 1e-10  # 2.1e-14
    assert residual(ours["h"], from_pinocchio["h"]) < 1e-10  # 2.1e-14


def test_energy(ours: dict[str, Array], from_mujoco: dict[str, Array]) -> None:
    kinetic, potential = (ours["energy"] - from_mujoco["energy"]).T
    scale = from_mujoco["energy"][:, 0]
    assert np.abs(kinetic / scale).max() < 1e-10  # 7e-15
    # The zero of height is arbitrary.
    assert (np.abs(potential - potential[0]) / scale).max() < 1e-10  # 4e-15


def test_momentum(
    ours: dict[str, Array], from_mujoco: dict[str, Array], from_pinocchio: dict[str, Array]
) -> None:
    assert residual(ours["momentum"], from_mujoco["momentum"]) < 1e-10  # 9e-15
    assert residual(ours["momentum"], from_pinocchio["momentum"]) < 1e-10  # 2.3e-14


def test_free_fall_accelerates_the_root_alone(case: Case) -> None:
    """At rest the bias is the weight, and M maps free fall with g to it."""
    for q in case.q[:100]:
        bias = case.ours.bias_forces(q, np.zeros_like(q))
        acceleration = np.linalg.solve(case.ours.mass_matrix(q), -bias)
        fall = np.zeros_like(q)
        fall[1] = -9.81
        np.testing.assert_allclose(acceleration, fall, rtol=0.0, atol=1e-9)  # 9e-12
