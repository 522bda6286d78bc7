"""Threads: a fork while the pool is built, and systems that start no thread."""

import re
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest

BINDINGS = Path(__file__).parents[1] / "rust" / "skate-py" / "src"

STEP = """
import gymnasium, numpy as np
from skate_env import IceSkateVectorEnv

def step():
    env = IceSkateVectorEnv(8, num_threads=4)
    env.reset(seed=1)
    actions = np.zeros(env.action_space.shape, np.float32)
    return env.step(actions)[0].tobytes()
"""

FORK = (
    STEP
    + """
import os, signal, threading, time

def grandchild(delay):
    # This process has no pool yet: the thread builds it while the process forks.
    thread = threading.Thread(target=step)
    thread.start()
    time.sleep(delay)
    child = os.fork()
    if child == 0:
        signal.alarm(20)
        step()
        os._exit(0)
    status = os.waitpid(child, 0)[1]
    thread.join()
    os._exit(0 if status == 0 else 1)

failed = 0
for i in range(60):
    child = os.fork()
    if child == 0:
        grandchild(1e-4 * i)
    failed += os.waitpid(child, 0)[1] != 0
print("failed", failed)
"""
)

LIMIT = (
    STEP
    + """
import os, resource, sys
wanted = step() if sys.argv[1] == "0" else None
used = int(open("/proc/self/statm").read().split()[0]) * resource.getpagesize()
limit = used + 2**20 * int(sys.argv[2])
resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
try:
    step()
    print("stepped")
except (MemoryError, ValueError) as error:
    print("refused", error)
"""
)


def python(code, *arguments):
    command = [sys.executable, "-c", textwrap.dedent(code), *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, timeout=500)


def test_a_fork_while_another_thread_builds_the_pool_works():
    done = python(FORK)
    assert done.stdout.strip() == "failed 0", done.stdout + done.stderr


def test_the_bindings_initialise_their_statics_at_import():
    """No value is created on first use, where a fork could leave it locked.

    The forks above find such a value once in some thousand children, so this reads the sources.
    """
    lazy = re.compile(r"static (\w+): \w*(?:OnceLock|LazyLock|OnceCell)|(intern!)")
    found = {
        (file.name, *filter(None, match.groups()))
        for file in BINDINGS.glob("**/*.rs")
        for match in lazy.finditer(file.read_text())
    }
    assert found == {("infos.rs", "KEYS")}
    start = re.search(r"fn initialise_statics.*?\n}\n", (BINDINGS / "lib.rs").read_text(), re.S)
    assert start and "infos::Keys::get(py);" in start.group()


# From too little for the environments to enough for all threads.
@pytest.mark.parametrize("mebibytes", [2, 4, 6, 8, 12, 16, 24, 64])
def test_fewer_threads_where_the_system_starts_no_more(mebibytes):
    done = python(LIMIT, 1, mebibytes)
    assert done.returncode == 0, (done.stdout, done.stderr)
    assert done.stdout.startswith(("stepped", "refused")), (done.stdout, done.stderr)
