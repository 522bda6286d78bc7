"""Threads: small stacks, a fork while the pool is built, and systems that start no thread."""

import os
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

STACK = """
import copy, pickle, threading
import numpy as np
from skate_env import IceSkateEnv, IceSkateVectorEnv, Scene, Simulator, gradients
from skate_env.environments.tasks import any_ice

def calls(accuracy):
    env = any_ice("paper_printed", accuracy=accuracy)
    env.reset(seed=0, options={"phase": 1.5})
    env.step(np.zeros(10))
    env.restore(env.snapshot())
    sim = Simulator(env.scene)
    sim.check_laws()
    sim.reset(params={"ice.gravity": 9.7})
    sim.perturb(0.02, 1)
    sim.kick(0.1)
    sim.advance(0.4)
    copy.deepcopy(sim).restore(sim.snapshot())
    for name in ("rhs", "guards", "sampled", "reset_map"):
        getattr(sim, name)(sim.time, sim.q, sim.v)
    for name in ("energy", "momentum", "bias_forces"):
        getattr(sim, name)(sim.q, sim.v)
    for work in ("rhs", "step", "batch"):
        sim.measure(work, 2)
    sim.mass_matrix(sim.q), sim.link_segments(), sim.torque, sim.acceleration, sim.violation()
    sim.displace(np.zeros(len(sim.state_vector())))
    many = IceSkateVectorEnv(
        20, accuracy=accuracy, max_episode_steps=2, autoreset_mode="SameStep", perturb=0.05
    )
    many.reset(seed=0)
    for _ in range(3):
        many.step(np.zeros((20, 10)))
    pickle.loads(pickle.dumps(many)).simulator(3)
    if isinstance(accuracy, str):
        many.advance_differentiated(np.zeros((20, 10)))
        sim = Simulator(many.scene)
        found = sim.linearize(until=0.4)
        found.tangent_before, found.tangent_after, found.events
        gradients.rollout(sim, np.zeros((2, 16)))

def everything():
    for read, text in ((Scene.from_json, '{"a": '), (Scene.from_toml, "a={")):
        try:
            read(10**5 * text)
        except ValueError:
            pass
    for accuracy in ("fast", "balanced", {"method": "rosenbrock", "tolerance": 1e-4}):
        calls(accuracy)
    print("done")

threading.stack_size(128 * 1024)
thread = threading.Thread(target=everything)
thread.start()
thread.join()
"""


def python(code, *arguments, **environment):
    command = [sys.executable, "-c", textwrap.dedent(code), *map(str, arguments)]
    env = {**os.environ, **environment}
    return subprocess.run(command, capture_output=True, text=True, timeout=500, env=env)


def test_calls_need_a_stack_of_128_kb():
    """A larger one, where a call needs it, is on the heap; threads of the pool have their own."""
    done = python(STACK, RUST_MIN_STACK="16384")
    assert done.stdout == "done\n", done.stdout + done.stderr


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
