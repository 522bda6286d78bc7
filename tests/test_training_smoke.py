"""A training of one minute with the usual command improves the policy."""

import numpy as np
from typer.testing import CliRunner

from skate_env import baseline
from skate_env.cli import app
from skate_env.learning import ppo
from skate_env.learning.rollouts import Conditions, run
from skate_env.policy import Policy

# An easy task: only staying upright is rewarded, with the coarse steps of `fast`.
LESSON = [
    "actions=400000",
    "envs=64",
    "rollout=32",
    "minibatch=512",
    "critic_first=8192",
    "rate=2e-3",
    "noise=0.3",
    "step=0.0025",
    "fine_from=1",
    "weights.alive=2",
    "weights.flight=1",
    "weights.slide=0",
    "weights.step=0",
]


def test_a_short_training_keeps_the_robot_on_its_feet(tmp_path):
    options = [f"--set={each}" for each in LESSON]
    result = CliRunner().invoke(app, ["train", "--out", str(tmp_path), *options])
    assert result.exit_code == 0, result.stderr
    learned = Policy.load(tmp_path / ppo.POLICY)
    untaught = baseline.no_residual("unilateral")
    disturbed = {"perturb": 0.02, "trunk_noise": 0.01}
    conditions = Conditions(16, steps=1000, longest=10.0, disturbances=disturbed, accuracy="fast")
    lasted = [
        np.mean(run(controller, environment, conditions)["time"])
        for controller, environment in (
            (learned, learned.environment()),
            (untaught, {"scene": untaught.scene}),
        )
    ]
    # 5.2 to 7.5 s (seeds 0 to 5) and 1.8 s.
    assert lasted[0] > 2.0 * lasted[1]
