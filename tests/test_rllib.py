"""PPO with RLlib on a Ray cluster of two nodes: two sets of processes without shared memory."""

import json
import re
import secrets
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

CLUSTER = Path(__file__).with_name("ray_cluster.py")


@pytest.fixture
def two_nodes(monkeypatch: pytest.MonkeyPatch) -> Iterator[dict[str, Any]]:
    """Start a cluster of two nodes with one CPU each, and remove it completely afterwards."""
    with tempfile.TemporaryDirectory(prefix="ray", ignore_cleanup_errors=True) as folder:
        monkeypatch.setenv("RAY_TMPDIR", folder)
        monkeypatch.setenv("RAY_AUTH_MODE", "token")
        monkeypatch.setenv("RAY_AUTH_TOKEN", secrets.token_hex())
        monkeypatch.setenv("RAY_USAGE_STATS_ENABLED", "0")
        command = [sys.executable, str(CLUSTER)]
        pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "stderr": subprocess.STDOUT}
        with subprocess.Popen(command, text=True, **pipes) as cluster:
            output = []
            for line in cluster.stdout:
                output.append(line)
                if line.startswith('{"address"'):
                    break
            else:
                pytest.fail("the cluster did not start:\n" + "".join(output))
            try:
                yield json.loads(output[-1])
            finally:
                # The end of its input stops the cluster.
                cluster.communicate(timeout=60)


def test_both_nodes_of_a_cluster_roll_out(two_nodes: dict[str, Any], tmp_path: Path) -> None:
    command = [sys.executable, "-m", "training.benchmark.rllib", "--address", two_nodes["address"]]
    command += ["--scene", "push_only", "--iterations", "2", "--out", str(tmp_path)]
    command += ["--envs-per-runner", "4", "--steps", "64"]
    run = subprocess.run(command, capture_output=True, text=True, timeout=300)
    assert run.returncode == 0, run.stdout + run.stderr
    sampled = dict(re.findall(r"^node (\w+) .*: (\d+) environment steps$", run.stdout, re.M))
    assert set(sampled) == set(two_nodes["nodes"])
    # Two iterations of 4 environments and 64 steps on each node; a reset is not a step.
    assert all(int(steps) >= 512 for steps in sampled.values()), sampled
    assert (tmp_path / "rllib_checkpoint.json").exists()
