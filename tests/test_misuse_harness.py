"""Hostile calls of every public callable; see `misuse_harness`."""

import subprocess
import sys
from pathlib import Path

import pytest

HARNESS = Path(__file__).with_name("misuse_harness.py")


def harness(calls, seed):
    command = [sys.executable, "-W", "ignore", HARNESS, "--calls", str(calls), "--seed", str(seed)]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr


def test_hostile_calls_are_refused_or_harmless():
    harness(2000, 0)


@pytest.mark.long("many hostile calls")
@pytest.mark.parametrize("seed", range(1, 5))
def test_many_hostile_calls_are_refused_or_harmless(seed):
    harness(20_000, seed)
