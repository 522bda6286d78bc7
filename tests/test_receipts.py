"""Receipts: a recorded motion is repeated bit for bit, and every change of it is found."""

from dataclasses import replace

import numpy as np
import pytest
from typer.testing import CliRunner

from skate_env import Simulator, scene_names
from skate_env.cli import app
from skate_env.replay import Recording, record
from skate_env.scenes import replace as changed


def recorded(scene="paper", policy=None, **keywords):
    sim = Simulator(scene)
    sim.perturb(0.01, 3)
    # Recordings begin anywhere, not only at starts.
    sim.step()
    sim.kick(0.1)
    return record(sim, 3, policy=policy, **keywords)


@pytest.mark.parametrize("accuracy", ["fast", "balanced", "reference"])
@pytest.mark.parametrize("name", scene_names())
def test_a_motion_is_repeated(name, accuracy, random_policy, tmp_path):
    scene = changed(name, {"accuracy": accuracy})
    policy = random_policy(name, size=0.2).on(scene)
    motion = recorded(scene, policy)
    assert np.any(motion.actions)
    motion.save(tmp_path / "motion.npz")
    found = Recording.load(tmp_path / "motion.npz").verify()
    assert found.difference is None
    assert found.actions == len(motion.actions)
    assert found.duration == motion.t[-1] - motion.t[0]


@pytest.mark.parametrize("density", [{"every": 4}, {"per_action": 3}])
def test_samples_may_be_rare_or_dense(density):
    motion = recorded(**density)
    assert motion.verify().difference is None
    assert motion.metadata["checksum"] == recorded().metadata["checksum"]


def next_number(values, place):
    values = values.copy()
    values[place] = np.nextafter(values[place], np.inf)
    return values


@pytest.mark.parametrize(("field", "name"), [("q", "q6"), ("v", "rate of q6")])
def test_a_changed_bit_of_a_sample_is_found(field, name):
    motion = recorded()
    other = replace(motion, **{field: next_number(getattr(motion, field), (50, 7))})
    found = other.verify()
    assert found.difference.startswith(f"{name} at {motion.t[50]:.6g} s: recorded ")
    assert found.actions == 50


def test_a_changed_action_is_found():
    motion = recorded()
    actions = motion.actions.copy()
    actions[30, 4] = 1e-6
    found = replace(motion, actions=actions).verify()
    assert f"at {motion.t[31]:.6g} s" in found.difference
    assert found.actions == 31


def test_without_samples_of_the_change_the_checksum_tells():
    motion = recorded()
    shorter = replace(motion, actions=motion.actions[:-1])
    assert "checksum" in shorter.verify().difference
    other = replace(motion, metadata={**motion.metadata, "checksum": "0" * 64})
    assert "checksum" in other.verify().difference


def test_the_command_says_yes_or_no(tmp_path):
    motion, file = recorded(), tmp_path / "motion.npz"
    motion.save(file)
    yes = CliRunner().invoke(app, ["replay", "--verify", str(file)])
    assert (yes.exit_code, yes.output.splitlines()[0]) == (0, "yes: the same bits")
    replace(motion, q=next_number(motion.q, (9, 3))).save(file)
    no = CliRunner().invoke(app, ["replay", "--verify", str(file)])
    assert no.exit_code == 1
    assert no.output.startswith("no: q2 at ")


def test_a_start_of_another_version_is_refused(tmp_path):
    motion, file = recorded(), tmp_path / "motion.npz"
    replace(motion, start=motion.start[::-1].copy()).save(file)
    refused = CliRunner().invoke(app, ["replay", "--verify", str(file)])
    assert refused.exit_code == 2
    assert "snapshot" in refused.output
