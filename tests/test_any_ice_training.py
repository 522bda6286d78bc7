"""The command that trains the policy for any ice."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from skate_env import Policy
from skate_env.environments import any_ice_scene
from skate_env.learning import ppo
from skate_env.learning.export import digest
from skate_env.scenes import loading as scenes
from training.benchmark import any_ice
from training.benchmark.any_ice import mean_of

SMALL = {"actions": 8 * 32 * 2, "envs": 8, "rollout": 32, "minibatch": 64, "epochs": 2}
PARTS = tuple(replace(part, numbers=part.numbers | SMALL) for part in any_ice.PARTS)


@pytest.fixture(autouse=True)
def _one_thread():
    torch.set_num_threads(1)


def test_every_part_begins_with_earlier_ones():
    names = [part.name for part in any_ice.PARTS]
    assert len(set(names)) == len(names) and set(any_ice.MEAN) < set(names)
    for i, part in enumerate(any_ice.PARTS):
        assert set(part.begins_with) <= set(names[:i])
        assert set(part.scenes) <= set(any_ice.FRICTION)


@pytest.mark.long("six small trainings")
def test_the_policy_is_the_mean_of_trainings_and_an_interrupted_command_goes_on(tmp_path):
    policy = any_ice.build(tmp_path, PARTS)
    trained = {part.name: Policy.load(tmp_path / part.name / ppo.POLICY) for part in PARTS}
    counted = mean_of([trained[name] for name in any_ice.MEAN], list(any_ice.MEAN.values()))
    assert digest(policy) == digest(counted)
    assert policy.scene == scenes.replace(any_ice_scene(), {"control.action_period": 0.02})
    begun = trained["starts"].about["begun_with"]
    assert begun == digest(mean_of([trained[name] for name in ("long", "longer", "medium")]))
    assert trained["long"].about["begun_with"] == digest(trained["scratch"])
    # One policy is missing, another one has only its checkpoint.
    (tmp_path / "short" / ppo.POLICY).unlink()
    (tmp_path / "starts" / ppo.POLICY).unlink()
    (tmp_path / "starts" / ppo.CHECKPOINT).unlink()
    again = any_ice.build(tmp_path, PARTS)
    np.testing.assert_array_equal(again.layers[0][0], policy.layers[0][0])
    assert digest(again) == digest(policy)
