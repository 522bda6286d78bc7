"""Arguments whose own code misbehaves, and arguments that would take too much memory."""

import subprocess
import sys

import numpy as np
import pytest

from skate_env import Simulator, load_scene
from skate_env.environments import IceSkateVectorEnv
from skate_env.scenes import replace


class Grows:
    """A number that adds entries to the dict which it belongs to."""

    def __init__(self, owner):
        self.owner = owner

    def __float__(self):
        self.owner.update({f"x{i}": 1.0 for i in range(100)})
        return 9.81


@pytest.mark.parametrize(
    "call",
    [
        lambda given: Simulator("paper").reset(params=given),
        lambda given: load_scene("paper").with_values(given),
        lambda given: IceSkateVectorEnv(1).reset(options={"params": given}),
    ],
    ids=["reset", "with_values", "options"],
)
def test_a_dict_that_changes_while_it_is_read(call):
    """The entries that were there count."""
    given = {}
    given |= {"ice.gravity": Grows(given), "ice.friction.mu_forward": 0.2}
    call(given)
    assert len(given) == 102


class Interrupted:
    """An argument whose own code ends as by Ctrl-C."""

    def stop(self, *_, **__):
        raise KeyboardInterrupt

    __array__ = __float__ = __index__ = __repr__ = stop


@pytest.mark.parametrize(
    "call",
    [
        lambda sim, x: sim.step(x),
        lambda sim, x: sim.kick(x),
        lambda sim, x: sim.measure("rhs", x),
        lambda sim, x: sim.measure(x, 1),
        lambda sim, x: sim.reset(support_leg=x),
    ],
    ids=["array", "float", "index", "repr", "repr of a leg"],
)
def test_an_interrupt_inside_an_argument_passes(call):
    sim = Simulator("paper")
    before = sim.snapshot()
    with pytest.raises(KeyboardInterrupt):
        call(sim, Interrupted())
    assert sim.snapshot() == before


def test_a_parameter_counts_once(refused):
    sim = Simulator("paper")
    twice = ["ice.gravity", "ice.friction.mu_forward", "ice.gravity"]
    refused(ValueError, lambda: sim.linearize(params=twice), '"ice.gravity" is repeated')


def test_a_displaced_state_has_a_range(refused):
    sim = Simulator("paper")
    before = sim.snapshot()
    for i, size in ((3, 1e7), (len(sim.q) + 2, -1e150)):
        dx = np.zeros(len(sim.state_vector()))
        dx[i] = size
        refused(ValueError, lambda dx=dx: sim.displace(dx), f"state + dx[{i}]", "[-1e6, 1e6]")
    assert sim.snapshot() == before


@pytest.mark.parametrize("name", ["a/b", "a\\b", "a\0b", "a\nb", "\x7f", "x" * 101])
def test_a_name_fits_into_a_file_name(refused, name):
    refused(ValueError, lambda: replace("paper", {"name": name}), "name = ", "100 characters")
    assert replace("paper", {"name": "Ä $x$ <" + "x" * 93}).name[0] == "Ä"


def test_derivatives_that_do_not_fit_are_refused():
    code = (
        "import resource, numpy as np\n"
        "from skate_env import IceSkateVectorEnv\n"
        "envs = IceSkateVectorEnv(700, num_threads=1)\n"
        "envs.reset(seed=0)\n"
        "before = envs.snapshot()\n"
        "used = int(open('/proc/self/statm').read().split()[0]) * 4096\n"
        "resource.setrlimit(resource.RLIMIT_AS, (used + 2**26,) * 2)\n"
        "try:\n    envs.advance_differentiated(np.zeros(envs.action_space.shape, np.float32))\n"
        "except ValueError as error:\n    print(error)\n"
        "assert envs.snapshot() == before\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert "derivatives of 700 environments take" in done.stdout


def test_numbers_beyond_floating_point_are_named(refused):
    huge = 10**400
    for value in (huge, [1.0, -huge], 10**5000):
        change = {"control.lifting.K_p": value}
        refused(ValueError, lambda change=change: replace("paper", change), "K_p = ", "finite")
    for name in ("perturb", "trunk_noise", "kick", "torque_limit"):
        refused(ValueError, lambda name=name: IceSkateVectorEnv(1, **{name: huge}), name)
    batch = IceSkateVectorEnv(1)._batch
    for name, seeds, elapsed in (
        ("seed", [-1], [0]),
        ("seed", [2**64], [0]),
        ("elapsed", [0], [-1]),
    ):
        refused(
            ValueError, lambda s=seeds, e=elapsed: batch.reset([0], s, e), f"{name} = ", "from 0"
        )


@pytest.mark.skipif(np.finfo(np.longdouble).max == np.finfo(float).max, reason="no wider numbers")
@pytest.mark.filterwarnings("error")
def test_numbers_that_only_a_longer_type_holds(refused):
    sim = Simulator("paper")
    torque = np.full(16, np.longdouble("1e4000"))
    refused(ValueError, lambda: sim.step(torque), "residual_torque")
