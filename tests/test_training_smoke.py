"""A training of less than a minute with the usual command improves the policy."""

import numpy as np
from typer.testing import CliRunner

from skate_env.cli import app
from skate_env.learning import ppo
from skate_env.learning.rollouts import Conditions, run
from skate_env.policies import Policy, baseline

# Few actions with the coarse steps of `fast`.
LESSON = [
    "actions=400000",
    "envs=64",
    "rollout=32",
    "minibatch=512",
    "rate=2e-3",
    "step=0.0025",
    "fine_from=1",
]


def test_a_short_training_keeps_the_robot_up(tmp_path):
    options = [f"--set={each}" for each in LESSON]
    result = CliRunner().invoke(app, ["train", "--out", str(tmp_path), *options])
    assert result.exit_code == 0, result.stderr
    learned = Policy.load(tmp_path / ppo.POLICY)
    untaught = baseline.no_residual("push_only")
    disturbed = {"perturb": 0.02, "trunk_noise": 0.01}
    conditions = Conditions(16, steps=1000, longest=10.0, disturbances=disturbed, accuracy="fast")
    played = [
        run(controller, environment, conditions)
        for controller, environment in (
            (learned, learned.environment()),
            (untaught, {"scene": untaught.scene}),
        )
    ]
    lasted, flight = ([np.mean(each[name]) for each in played] for name in ("time", "flight"))
    # 6.4 and 6.0 s (seeds 1 and 2), and 2.0 s.
    assert lasted[0] > 2.0 * lasted[1]
    # 35 and 45 % of the time, and 50 %.
    assert flight[0] < flight[1]
