"""The learning code without PyTorch: evaluation, configurations, and what `train` asks for."""

import subprocess
import sys

from typer.testing import CliRunner

from skate_env.cli import app
from skate_env.learning.rollouts import Conditions, run
from skate_env.policies import Policy, shipped


def test_the_shipped_policy_is_evaluated_without_torch() -> None:
    before = "torch" in sys.modules
    policy = Policy.load(shipped("push_only"))
    figures = run(
        policy,
        policy.environment(),
        Conditions(episodes=4, steps=2, disturbances={"perturb": 0.01}),
    )
    assert len(figures["steps"]) == 4 and figures["completed"].all()
    assert ("torch" in sys.modules) == before


def test_help_of_both_commands_shows_examples() -> None:
    for command in ("train", "evaluate"):
        result = CliRunner().invoke(app, [command, "--help"])
        assert result.exit_code == 0 and f"skate-env {command}" in result.output


def test_train_names_the_extra_that_it_needs() -> None:
    blocked = "import sys; sys.modules['stable_baselines3'] = None; sys.modules['torch'] = None\n"
    code = blocked + "from skate_env.cli import app; app(['train', '--out', 'out'])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert done.returncode != 0
    assert 'pip install "skate-env[train]"' in done.stderr
