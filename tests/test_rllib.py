"""PPO with RLlib on a Ray cluster of two nodes: two sets of processes without shared memory."""

import re
import secrets
import subprocess
import sys
import tempfile

import pytest


@pytest.fixture
def two_nodes(monkeypatch):
    """Start a cluster of two nodes with one CPU each, and remove it completely afterwards."""
    with tempfile.TemporaryDirectory(prefix="ray", ignore_cleanup_errors=True) as folder:
        monkeypatch.setenv("RAY_TMPDIR", folder)
        monkeypatch.setenv("RAY_AUTH_MODE", "token")
        monkeypatch.setenv("RAY_AUTH_TOKEN", secrets.token_hex())
        monkeypatch.setenv("RAY_USAGE_STATS_ENABLED", "0")
        # Ray reads the variables on import.
        from ray.cluster_utils import Cluster

        cluster = Cluster()
        try:
            for _ in range(2):
                cluster.add_node(num_cpus=1, object_store_memory=100 * 2**20)
            yield cluster
        finally:
            cluster.shutdown()


def test_both_nodes_of_a_cluster_roll_out(two_nodes, tmp_path):
    command = [sys.executable, "-m", "training.train_rllib", "--address", two_nodes.address]
    command += ["--scene", "unilateral", "--iterations", "2", "--out", str(tmp_path)]
    command += ["--envs-per-runner", "4", "--steps", "64"]
    run = subprocess.run(command, capture_output=True, text=True, timeout=300)
    assert run.returncode == 0, run.stdout + run.stderr
    sampled = dict(re.findall(r"^node (\w+) .*: (\d+) environment steps$", run.stdout, re.M))
    nodes = {node.node_id for node in two_nodes.list_all_nodes()}
    assert set(sampled) == nodes
    # Two iterations of 4 environments and 64 steps on each node; a reset is not a step.
    assert all(int(steps) >= 512 for steps in sampled.values()), sampled
    assert (tmp_path / "rllib_checkpoint.json").exists()
