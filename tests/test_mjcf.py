"""The MuJoCo model agrees with the scene."""

from collections.abc import Callable
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

import mujoco
import numpy as np
import pytest

from skate_env import Scene, Simulator, load_scene, to_mjcf
from skate_env.scenes import replace
from skate_env.studies.fixtures import BLADE

Paper = Callable[..., Scene]

ARMS = ["q11", "q12", "q13", "q14", "q15", "q16"]


def load(scene: Scene, **options: Any) -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_string(to_mjcf(scene, **options))


@pytest.mark.parametrize("locked", [[], ARMS], ids=["whole", "no_arms"])
def test_joints_are_the_coordinates(locked: list[str], paper: Paper) -> None:
    scene = paper(locked=locked)
    simulator = Simulator(scene)
    model = load(scene)
    assert [model.joint(i).name for i in range(model.njnt)] == simulator.coordinate_names
    damping = [0.0, 0.0, *(body["damping"] for body in simulator.bodies())]
    np.testing.assert_array_equal(model.dof_damping, damping)
    np.testing.assert_array_equal(model.dof_armature, 0.0)


@pytest.mark.parametrize("locked", [[], ARMS], ids=["whole", "no_arms"])
def test_weighs_what_table_1_says(locked: list[str], paper: Paper) -> None:
    model = load(paper(locked=locked))
    assert model.body_mass.sum() == pytest.approx(64.2, rel=1e-14)


@pytest.mark.parametrize("name", ["<&\"'>", "\ufffe\uffff", "\U0001f600 ü", ""])
def test_every_name_is_valid_xml(name: str) -> None:
    scene = replace("paper", {"name": name})
    model = ET.fromstring(to_mjcf(scene)).get("model")
    assert model == name.replace("\ufffe", "_").replace("\uffff", "_")
    assert load(scene).nbody > 1


def test_options_reach_mujoco(paper: Paper) -> None:
    model = load(paper(**{"ice.gravity": 1.62}), timestep=0.0005)
    assert model.opt.timestep == 0.0005
    np.testing.assert_array_equal(model.opt.gravity, [0.0, 0.0, -1.62])


@pytest.mark.parametrize("locked", [[], ARMS], ids=["whole", "no_arms"])
def test_links_are_drawn_where_they_are(locked: list[str], paper: Paper) -> None:
    """Every geom is centred on its link's segment; the feet half their height above it."""
    scene = paper(locked=locked)
    simulator = Simulator(scene)
    model = load(scene)
    data = mujoco.MjData(model)
    q = np.random.default_rng(5).uniform(-1.0, 1.0, model.nq)
    data.qpos = q
    mujoco.mj_kinematics(model, data)
    middles = simulator.link_segments(q).mean(axis=1)
    height = scene.get("body.foot.height")
    drawn = []
    for i in range(model.ngeom):
        if model.geom(i).type == mujoco.mjtGeom.mjGEOM_PLANE:
            continue
        up = data.geom_xmat[i].reshape(3, 3)[:, 2]
        lift = height / 2 if model.geom(i).type == mujoco.mjtGeom.mjGEOM_BOX else 0.0
        drawn.append(data.geom_xpos[i] - lift * up)
    assert len(drawn) == 17
    for middle in middles:
        assert np.linalg.norm(np.array(drawn) - middle, axis=1).min() < 1e-12


@pytest.mark.parametrize("name", ["push_only", "paper", BLADE])
def test_pose_and_velocity_are_the_simulator_s(name: str | Path) -> None:
    """In every contact state. Residuals: heights 4e-16 m, velocities 2e-14 m/s, energy 1e-13."""
    scene = load_scene(name)
    simulator, model = Simulator(scene), load(scene)
    data, rng, states = mujoco.MjData(model), np.random.default_rng(3), set()
    mass = model.body_mass.sum()
    for seed in range(4):
        simulator.perturb(0.01, seed)
        for _ in range(120):
            if not simulator.step(20.0 * rng.uniform(-1.0, 1.0, model.nv - 3)):
                break
            data.qpos[:], data.qvel[:] = q, v = simulator.q, simulator.v
            mujoco.mj_forward(model, data)
            mujoco.mj_subtreeVel(model, data)
            kinetic, potential = simulator.energy(q, v)
            height = data.subtree_com[1][2]
            assert abs(height - potential / (mass * scene.get("ice.gravity"))) < 1e-13
            speed = data.subtree_linvel[1][1:] - simulator.momentum(q, v)[:2] / mass
            assert np.abs(speed).max() < 1e-12
            mujoco.mj_energyVel(model, data)
            assert abs(data.energy[1] - kinetic) < 1e-11 * kinetic
            heels = simulator.link_segments()[[0, 6], 0, 2]
            np.testing.assert_allclose(heels, simulator.gaps()[:, 0], atol=1e-14)
            states.add(simulator.state_name.replace("stick", "slide"))
    assert name != "push_only" or "slide_roll_heel/air" in states


def test_heels_and_toes_touch_the_ice(paper: Paper) -> None:
    """Flat on the ice, heels and toes are in contact with the friction of forward sliding."""
    model = load(paper(), contact=True)
    data = mujoco.MjData(model)
    data.qpos[1] = -1e-9  # A sole exactly at the ice may lose contact by rounding.
    mujoco.mj_forward(model, data)
    assert {model.geom(g).name for pair in data.contact.geom for g in pair} == {
        "ice",
        "heel1",
        "toe1",
        "heel7",
        "toe7",
    }
    np.testing.assert_array_equal(data.contact.friction[:, 0], 0.2)


def test_nothing_touches_without_contact(paper: Paper) -> None:
    model = load(paper())
    data = mujoco.MjData(model)
    data.qpos[1] = -0.1
    mujoco.mj_forward(model, data)
    assert data.ncon == 0
