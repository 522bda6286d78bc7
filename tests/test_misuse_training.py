"""A training that a signal ends leaves a checkpoint that resumes to the same bits."""

import os
import signal
import subprocess
import sys
import time

import pytest

pytest.importorskip("stable_baselines3")

SMALL = ["actions=4096", "envs=8", "rollout=128", "minibatch=256"]


def start(folder, *arguments):
    command = [sys.executable, "-m", "skate_env", "train", "--out", folder, *arguments]
    return subprocess.Popen(
        command,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=os.environ,
        # A shell's background job ignores SIGINT, and so do its children.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )


def digest(process):
    out, err = process.communicate(timeout=300)
    assert process.returncode == 0, (out, err)
    return out.split()[-1]


@pytest.mark.parametrize(
    "number",
    [
        pytest.param(signal.SIGTERM, marks=pytest.mark.long("as SIGINT")),
        signal.SIGINT,
        pytest.param(signal.SIGKILL, marks=pytest.mark.long("as SIGINT")),
    ],
)
def test_a_training_that_a_signal_ends_resumes_to_the_same_bits(number, tmp_path):
    options = [word for each in SMALL for word in ("--set", each)]
    whole = digest(start(tmp_path / "whole", *options))
    process = start(tmp_path / "cut", *options)
    deadline = time.monotonic() + 120.0
    while not (tmp_path / "cut" / "checkpoint.pkl").exists() and time.monotonic() < deadline:
        time.sleep(0.02)
    process.send_signal(number)
    out, err = process.communicate(timeout=60)
    assert process.returncode != 0 and "SHA-256" not in out, (out, err)
    assert not (tmp_path / "cut" / "policy.npz").exists()
    assert digest(start(tmp_path / "cut", "--resume")) == whole
