"""Signals interrupt long calls soon; the state is valid afterwards."""

import contextlib
import signal
import time

import numpy as np
import pytest

from skate_env import Simulator
from skate_env.environments import IceSkateEnv, IceSkateVectorEnv
from skate_env.scenes import replace

# Calls answer within 0.14 s on two busy cores.
MOST = 2.0


class Stop(Exception):
    """Raised by the signal's handler, as `KeyboardInterrupt` is by Python's own."""


@contextlib.contextmanager
def interrupted(after=0.2):
    """Send a signal after a time [s]; the body must raise soon."""

    def handler(*_):
        raise Stop

    before = signal.signal(signal.SIGALRM, handler)
    signal.setitimer(signal.ITIMER_REAL, after)
    started = time.monotonic()
    try:
        with pytest.raises(Stop):
            yield
        assert time.monotonic() - started < after + MOST
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


def simulator(accuracy):
    return Simulator(replace("paper", {"accuracy": accuracy}))


@pytest.mark.parametrize("accuracy", ["fast", "reference"])
def test_advance_stops_at_the_end_of_a_time_step(accuracy):
    sim = simulator(accuracy)
    with interrupted():
        sim.advance(9999.0)
    assert 0.0 < sim.time < 9999.0 and sim.termination is None
    # The state is that of an advance to this time: it is saved, restored and continued.
    twin = simulator(accuracy)
    twin.restore(sim.snapshot())
    assert sim.step() and twin.step()
    assert sim.snapshot() == twin.snapshot()


def test_a_short_call_is_the_same_with_and_without_a_signal():
    sim, twin = simulator("balanced"), simulator("balanced")
    arrived = []
    before = signal.signal(signal.SIGALRM, lambda *_: arrived.append(1))
    try:
        # A handler that raises nothing interrupts nothing.
        signal.setitimer(signal.ITIMER_REAL, 0.01, 0.01)
        sim.advance(20.0)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)
    twin.advance(20.0)
    assert arrived and sim.snapshot() == twin.snapshot()


def test_an_interrupted_reset_changes_nothing():
    env = IceSkateEnv(accuracy="reference")
    env.reset(seed=1)
    before = env.snapshot()
    with interrupted():
        env.reset(seed=2, options={"phase": 1000})
    assert env.snapshot() == before


@pytest.mark.parametrize("threads", [1, 3])
def test_an_interrupted_vector_reset_changes_nothing(threads):
    env = IceSkateVectorEnv(8, accuracy="reference", num_threads=threads)
    env.reset(seed=1)
    before = env.snapshot()
    with interrupted():
        env.reset(seed=2, options={"phase": 1000})
    assert env.snapshot() == before


@pytest.mark.parametrize(("accuracy", "n"), [("fast", 3000), ("reference", 150)])
@pytest.mark.parametrize("threads", [1, 3])
def test_an_interrupted_vector_step_leaves_whole_actions(accuracy, n, threads):
    env = IceSkateVectorEnv(n, accuracy=accuracy, action_period=0.5, num_threads=threads)
    env.reset(seed=1)
    actions = np.zeros((n, len(env.joint_names)), np.float32)
    with interrupted(0.05):
        for _ in range(200):
            env.step(actions)
    times = {env.info(i)["time"] / 0.5 for i in range(n)}
    assert all(abs(actions - round(actions)) < 1e-9 for actions in times)
    env.step(actions)


@pytest.mark.parametrize("work", ["rhs", "step", "batch"])
def test_measurements_stop(work):
    sim = simulator("fast")
    before = sim.snapshot()
    with interrupted(0.05):
        sim.measure(work, 2**32 - 1)
    assert sim.snapshot() == before
